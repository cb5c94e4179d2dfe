#include "overlap_oracle.h"

#include <algorithm>

#include "recorder.h"

namespace sap_test {
namespace {

std::size_t geomsOf(const Contacts& contacts) {
  std::size_t geoms = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    geoms += i == 0 || contacts[i].o2 != contacts[i - 1].o2;
  return geoms;
}

std::size_t collideAll(dSpaceID space, Probes& probes, int flags, void* data,
                       dParallelSAPOverlapCallback* callback) {
  for (dParallelSAPProbe& probe : probes) probe.touched = 77;
  return dParallelSAPSpaceOverlaps(space, probes.data(), probes.size(), sizeof probes[0], flags,
                                   data, callback);
}

}  // namespace

std::vector<Contacts> owedOverlaps(dSpaceID space, const Probes& probes, int flags,
                                   const Filter& filter) {
  std::vector<Contacts> owed;
  struct Asked {
    dBodyID ignore;
    int flags;
    const Filter& filter;
    std::size_t probe;
  };
  for (const dParallelSAPProbe& probe : probes) {
    Asked asked = {probe.ignore, flags & 0xffff ? flags : flags | 1, filter, owed.size()};
    SerialLoop loop;
    loop.data = &asked;
    loop.flags_of = [](void* data, dGeomID, dGeomID geom) {
      const Asked& of = *static_cast<Asked*>(data);
      if (of.filter && !of.filter(of.probe, geom)) return 0;
      return of.ignore && dGeomGetBody(geom) == of.ignore ? 0 : of.flags;
    };
    dSpaceCollide2(probe.geom, asGeom(space), &loop, SerialLoop::collide);
    owed.push_back(loop.contacts);
  }
  return owed;
}

std::string wrongOverlaps(dSpaceID space, const Probes& probes, int flags,
                          const std::vector<Contacts>& owed) {
  struct Told {
    Probes probes;
    std::vector<Contacts> contacts;
    std::size_t last = 0;
    bool in_order = true;
  } told;
  told.probes = probes;
  told.contacts.resize(probes.size());
  std::size_t sum = 0;
  for (const Contacts& each : owed) sum += geomsOf(each);
  const auto tell = [](void* data, std::size_t probe, dGeomID geom, const dContactGeom* contacts,
                       int count) {
    Told& all = *static_cast<Told*>(data);
    all.in_order = all.in_order && probe >= all.last && count > 0;
    all.last = probe;
    recordContacts(&all.contacts.at(probe), all.probes[probe].geom, geom, contacts, count);
  };
  Probes counted = probes, said = probes;
  const std::size_t touching = static_cast<std::size_t>(
      std::count_if(owed.begin(), owed.end(), [](const Contacts& each) { return !each.empty(); }));
  if (collideAll(space, told.probes, flags, &told, tell) != sum) return "another number of all";
  if (collideAll(space, counted, flags, nullptr, nullptr) != sum) return "another number counted";
  if (collideAll(space, said, flags | dParallelSAPOverlapAny, nullptr, nullptr) != touching)
    return "another number of probes that touch";
  if (!told.in_order) return "not in the order of the probes";
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const std::string name = "probe " + std::to_string(i) + ": ";
    const std::string contacts = difference(told.contacts[i], owed[i]);
    if (contacts != "") return name + contacts;
    const std::size_t geoms = geomsOf(owed[i]);
    if (told.probes[i].touched != geoms || counted[i].touched != geoms)
      return name + "another number of geoms";
    if (said[i].touched != (geoms > 0)) return name + "another yes or no";
  }
  return "";
}

}  // namespace sap_test
