#include "overlap_oracle.h"

#include <cmath>
#include <numeric>

#include "recorder.h"

namespace sap_test {

OverlapAnswers owedOverlaps(dSpaceID space, const Probes& probes, int flags, const Filter& filter) {
  OverlapAnswers owed;
  struct Asked {
    dBodyID ignore;
    int flags;
    const Filter& filter;
    std::size_t probe;
  };
  for (const dParallelSAPProbe& probe : probes) {
    Asked asked = {probe.ignore, flags & 0xffff ? flags : flags | 1, filter, owed.contacts.size()};
    SerialLoop loop;
    loop.data = &asked;
    loop.flags_of = [](void* data, dGeomID, dGeomID geom) {
      const Asked& of = *static_cast<Asked*>(data);
      if (of.filter && !of.filter(of.probe, geom)) return 0;
      return of.ignore && dGeomGetBody(geom) == of.ignore ? 0 : of.flags;
    };
    dSpaceCollide2(probe.geom, asGeom(space), &loop, SerialLoop::collide);
    const Contacts& contacts = loop.contacts;
    std::size_t geoms = 0;
    for (std::size_t i = 0; i < contacts.size(); ++i)
      geoms += i == 0 || contacts[i].o2 != contacts[i - 1].o2;
    owed.contacts.push_back(contacts);
    owed.touched.push_back(geoms);
    owed.any.push_back(geoms > 0);
  }
  owed.counted = owed.touched;
  return owed;
}

std::string difference(const OverlapAnswers& got, const OverlapAnswers& owed) {
  if (got.contacts.size() != owed.contacts.size())
    return "another number of geoms returned, or not in the order of the probes";
  for (std::size_t i = 0; i < owed.contacts.size(); ++i) {
    const std::string contacts = difference(got.contacts[i], owed.contacts[i]);
    if (contacts != "") return "probe " + std::to_string(i) + ": " + contacts;
  }
  return got.touched != owed.touched   ? "another number of geoms"
         : got.counted != owed.counted ? "another number counted"
         : got.any != owed.any         ? "another yes or no"
                                       : "";
}

ProbeBatch::ProbeBatch(std::size_t n, Random& of) : random(of) {
  for (std::size_t i = 0; i < n; ++i) {
    const dSpaceID space = random.chance(0.5) ? dSpaceID(other) : nullptr;
    const std::size_t kind = random.below(4);  // convexes may not meet all meshes of the scenes
    probes.push_back({kind == 0   ? dCreateSphere(space, 1)
                      : kind == 1 ? dCreateBox(space, 1, 2, dReal(0.5))
                      : kind == 2 ? dCreateCapsule(space, dReal(0.4), 1)
                                  : dCreateCylinder(space, dReal(0.4), 1),
                      nullptr, 0});
  }
  own_ = probes;
}

ProbeBatch::~ProbeBatch() {
  for (const dParallelSAPProbe& probe : own_) dGeomDestroy(probe.geom);
}

void ProbeBatch::moveTo(const std::vector<dGeomID>& geoms) {
  for (dParallelSAPProbe& probe : own_) {
    const dGeomID at = geoms[random.below(geoms.size())];
    dReal bounds[6], place[3];
    dGeomGetAABB(at, bounds);
    for (int axis = 0; axis < 3; ++axis) {
      place[axis] = bounds[2 * axis] +
                    (bounds[2 * axis + 1] - bounds[2 * axis]) * real(random.between(-0.2, 1.2));
      if (!std::isfinite(place[axis])) place[axis] = real(random.gauss());
    }
    dGeomSetPosition(probe.geom, place[0], place[1], place[2]);
    dMatrix3 turned;
    dRFromEulerAngles(turned, real(random.gauss()), 1, place[0]);
    dGeomSetRotation(probe.geom, turned);
    probe.ignore = random.chance(0.3) ? dGeomGetBody(at) : nullptr;
    if (random.chance(0.1)) dGeomSetCategoryBits(probe.geom, random.below(16));
    if (random.chance(0.1)) dGeomSetCollideBits(probe.geom, random.below(16));
    if (random.chance(0.1)) dGeomDisable(probe.geom);
  }
  probes = own_;
}

OverlapAnswers ProbeBatch::ask(dSpaceID space, int flags) const {
  OverlapAnswers answers;
  std::size_t last = 0;
  bool right = true;
  answers.contacts.resize(probes.size());
  auto take = [&](std::size_t probe, dGeomID geom, const dContactGeom* contacts, int count) {
    right = right && probe >= last && count > 0;
    last = probe;
    recordContacts(&answers.contacts.at(probe), probes[probe].geom, geom, contacts, count);
  };
  const auto call = [&](int more, dParallelSAPOverlapCallback* callback) {
    Probes asked = probes;
    for (dParallelSAPProbe& probe : asked) probe.touched = 77;
    const std::size_t sum = dParallelSAPSpaceOverlaps(
        space, asked.data(), asked.size(), sizeof asked[0], flags | more, &take, callback);
    std::vector<std::size_t> touched;
    for (const dParallelSAPProbe& probe : asked) touched.push_back(probe.touched);
    right = right && sum == std::accumulate(touched.begin(), touched.end(), std::size_t{0});
    return touched;
  };
  answers.touched = call(0, invoke<decltype(take)>);
  answers.counted = call(0, nullptr);
  answers.any = call(dParallelSAPOverlapAny, nullptr);
  if (!right) answers.contacts.clear();
  return answers;
}

std::size_t ProbeBatch::meeting(const OverlapAnswers& answers) {
  return std::accumulate(answers.any.begin(), answers.any.end(), std::size_t{0});
}

void ProbeBatch::report(dSpaceID space, int flags,
                        const std::function<void(dGeomID)>& callback) const {
  Probes asked = probes;
  auto take = [&](std::size_t, dGeomID geom, const dContactGeom*, int) { callback(geom); };
  dParallelSAPSpaceOverlaps(space, asked.data(), asked.size(), sizeof asked[0], flags, &take,
                            invoke<decltype(take)>);
}

}  // namespace sap_test
