// Collides of all kinds, each compared with the oracle.
#include "driver.h"

namespace sap_test {
namespace {

// A pair of spaces or of a space and a geom that the callback takes apart, or a whole space.
struct TakenApart {
  std::size_t first, second;
  Pairs pairs;
  std::vector<TakenApart> within;

  static void call(void* data, dGeomID a, dGeomID b) {
    TakenApart& self = *static_cast<TakenApart*>(data);
    record(&self.pairs, a, b);
    if (!dGeomIsSpace(a) && !dGeomIsSpace(b)) return;
    self.within.push_back({number(a), number(b), {}, {}});
    dSpaceCollide2(a, b, &self.within.back(), call);
  }
};

}  // namespace

bool Driver::mayProbe(dGeomID geom) {
  const Bounds bounds = boundsOf(geom);
  return holdsGeom(geom) &&
         std::none_of(bounds.begin(), bounds.end(), [](dReal b) { return b != b; });
}

// The mode in which the program runs for a while.
unsigned Driver::mode() {
  const unsigned modes[] = {FloatingPointMode::kDefault, FloatingPointMode::kFlushing,
                            FloatingPointMode::kUpward, FloatingPointMode::kDownward,
                            FloatingPointMode::kTowardZero};
  return decisions_.chance(230) ? modes[0] : modes[decisions_.below(std::size(modes))];
}

std::vector<dGeomID> Driver::membersOf(int space) const {
  std::vector<dGeomID> geoms;
  for (const int member : objects_[space].members) geoms.push_back(objects_[member].geom);
  return geoms;
}

// ODE's own spaces have NaN and empty sub-spaces among their pairs.
Pairs Driver::soundOf(const Pairs& pairs) const {
  Pairs sound;
  for (const Pair& pair : pairs)
    if (mayProbe(objects_[pair.first].geom) && mayProbe(objects_[pair.second].geom))
      sound.push_back(pair);
  return sound;
}

// The space's geoms as dSpaceGetGeom and dSpaceQuery give them, those of ours in their order.
void Driver::checkList(int space) {
  const dSpaceID id = spaceOf(space);
  std::vector<int> listed, members = objects_[space].members;
  for (int i = 0; i < dSpaceGetNumGeoms(id); ++i)
    listed.push_back(static_cast<int>(number(dSpaceGetGeom(id, i))));
  if (!objects_[space].ours) {
    std::sort(listed.begin(), listed.end());
    std::sort(members.begin(), members.end());
  }
  if (listed != members) fail("space " + std::to_string(space) + ": dSpaceGetGeom lists others");
  for (const Object& o : objects_)
    if (o.geom && (dSpaceQuery(id, o.geom) != 0) != (o.parent == space))
      fail("space " + std::to_string(space) + ": dSpaceQuery is wrong about " +
           std::to_string(number(o.geom)));
}

bool Driver::isSwept(int object) const {
  const Object& o = objects_[object];
  return o.kind == kSpace && ((o.ours && dParallelSAPSpaceGetSweptBounds(spaceOf(object)) > 0) ||
                              std::any_of(o.members.begin(), o.members.end(),
                                          [this](int member) { return isSwept(member); }));
}

// The boxes of a space and its sub-spaces hold what is in them, whatever changed without a word,
// but for swept spaces in stock ones, which may not cover their motion. Sub-spaces of ours find
// nothing left to bring up to date; not always, so that some stay as they are.
bool Driver::boxesAreWhole(int space) const {
  const Bounds box = boundsOf(objects_[space].geom);
  for (const int member : objects_[space].members) {
    if (!objects_[space].ours && isSwept(member)) continue;
    const Bounds bounds = boundsOf(objects_[member].geom);
    for (std::size_t i = 0; i < 6; i += 2)
      if (bounds[i] < box[i] || bounds[i + 1] > box[i + 1]) return false;
    if (objects_[member].kind != kSpace) continue;
    if (objects_[space].ours && objects_[member].ours && collides_ % 2) {
      dSpaceClean(spaceOf(member));
      if (boundsOf(objects_[member].geom) != bounds) return false;
    }
    if (!boxesAreWhole(member)) return false;
  }
  return true;
}

void Driver::compare(int space, const Pairs& got, bool last) {
  const Object& o = objects_[space];
  ++collides_;
  std::string problem =
      o.ours ? wrongByRules(Rules::of(spaceOf(space)), membersOf(space), got)
             : difference(asSet(soundOf(got)), asSet(expectedPairs(membersOf(space))));
  if (problem.empty()) problem = problemOfNumbers(space, got);
  if (problem.empty() && o.ours && last && statsOf(spaceOf(space)).pairs != got.size())
    problem = "statistics count other pairs";
  // Disabled geoms that are asleep may be counted as unbounded, too.
  if (problem.empty() && o.ours && last && !dParallelSAPSpaceGetSkipAsleep(spaceOf(space)))
    problem = wrongCounts(spaceOf(space), membersOf(space), got.size());
  if (problem.empty() && o.ours && !boxesAreWhole(space)) problem = "a space has another box";
  if (!problem.empty()) fail("space " + std::to_string(space) + ": " + problem);
}

// `with`: itself, with which dSpaceCollide2 is dSpaceCollide.
void Driver::collidePlain(int space, dGeomID with) {
  log("collide " + std::to_string(space));
  if (!objects_[space].ours) announceMeshes();
  Pairs got;
  {
    const FloatingPointMode scoped(mode());
    got = with ? collide2(with, with) : collide(spaceOf(space));
  }
  compare(space, got);
  checkList(space);
}

void Driver::collideAnyhow() {
  switch (decisions_.below(4)) {
    case 0:
      collideTakingApart(pickOurSpace());
      break;
    case 1:
      collideEditing();
      break;
    default:
      collidePlain(pickSpace());
  }
}

// As ODE's manual has it: the callback takes spaces apart, all the way down.
void Driver::collideTakingApart(int space) {
  log("collide " + std::to_string(space) + " and take apart its spaces");
  TakenApart whole = {};
  dSpaceCollide(spaceOf(space), &whole, TakenApart::call);
  compare(space, whole.pairs);
  std::vector<const TakenApart*> left = {&whole};
  while (!left.empty()) {
    const TakenApart& next = *left.back();
    left.pop_back();
    for (const TakenApart& pair : next.within) {
      compareTwo(static_cast<int>(pair.first), static_cast<int>(pair.second), pair.pairs);
      left.push_back(&pair);
    }
  }
}

// dSpaceCollide2 of two objects, spaces or not, as ODE does it: which of two spaces is walked, and
// which is asked, depends on their sublevels and sizes.
Pairs Driver::expectedOfTwo(int first, int second, bool& ordered, int& asked) const {
  asked = objects_[first].kind == kSpace ? first : kNone;
  int other = objects_[second].kind == kSpace ? second : kNone;
  if (asked != kNone && other != kNone) {
    const int a = dSpaceGetSublevel(spaceOf(asked)), b = dSpaceGetSublevel(spaceOf(other));
    if (a < b) asked = kNone;
    if (a > b) other = kNone;
  }
  std::vector<int> walked;
  bool swapped = false;
  ordered = true;
  if (asked != kNone && other != kNone) {
    swapped = objects_[asked].members.size() < objects_[other].members.size();
    if (swapped) std::swap(asked, other);
    walked = objects_[other].members;
    ordered = objects_[other].ours;  // stock spaces have an order of their own
  } else {
    swapped = asked == kNone;
    walked = {swapped ? first : second};
    if (swapped) asked = other;
  }
  ordered = ordered && objects_[asked].ours;
  Pairs pairs;
  for (const int probe : walked) {
    if (!mayProbe(objects_[probe].geom)) continue;
    for (const int own : objects_[asked].members) {
      if (!takesPart(objects_[own].geom) || !mayTouch(objects_[own].geom, objects_[probe].geom)) {
        continue;
      }
      pairs.push_back(swapped ? Pair(probe, own) : Pair(own, probe));
    }
  }
  return pairs;
}

void Driver::compareTwo(int first, int second) {
  for (const int of : {first, second})
    if (objects_[of].kind == kSpace && !objects_[of].ours) announceMeshes();
  Pairs got;
  {
    const FloatingPointMode scoped(mode());
    got = collide2(objects_[first].geom, objects_[second].geom);
  }
  compareTwo(first, second, got);
}

void Driver::compareTwo(int first, int second, const Pairs& got) {
  bool ordered = false;
  int asked = kNone;
  Pairs expected = expectedOfTwo(first, second, ordered, asked);
  if (Rules::of(spaceOf(asked)).cull_planes)
    expected = withoutCulled(expected, got, [&](std::size_t i) { return objects_[i].geom; });
  ++collides_;
  const std::string problem =
      ordered ? difference(got, expected) : difference(sorted(soundOf(got)), sorted(expected));
  if (problem.empty()) return;
  fail("dSpaceCollide2 (" + std::to_string(first) + ", " + std::to_string(second) +
       "): " + problem);
}

void Driver::collideWithGeom() {
  int first = pickSpace(), second = pickSpace();
  Random random = decisions_.random();
  if (random.chance(0.7)) {
    const int member = pickMember(second, random);
    if (member != kNone) second = member;
  } else if (random.chance(0.3) && !alive_.empty()) {
    second = alive_[random.below(alive_.size())];
  }
  if (first == second) return collidePlain(first, objects_[first].geom);
  if (random.chance(0.3)) std::swap(first, second);
  for (const int object : within(second))
    if (random.chance(0.3)) changeUnasked(object, 0, random);
  log("collide2 " + std::to_string(first) + ", " + std::to_string(second));
  compareTwo(first, second);
}

// Many geoms against one space, which changes a little between some of them.
void Driver::collideWithMany() {
  const int space = pickSpace();
  const std::size_t count = 1 + decisions_.below(40);
  const double changing = decisions_.chance(128) ? 0 : 0.2;
  Random random = decisions_.random();
  log(std::to_string(count) + " geoms against " + std::to_string(space) +
      (changing > 0 ? ", which changes between" : ""));
  for (std::size_t i = 0; i < count && !alive_.empty() && problem_.empty(); ++i) {
    compareTwo(space, alive_[random.below(alive_.size())]);
    const int member = pickMember(space, random);
    if (member == kNone || objects_[member].kind == kSpace || !random.chance(changing)) continue;
    if (random.chance(0.25)) compare(space, collide(spaceOf(space)));
    changeAnyhow(member, random);
  }
}

}  // namespace sap_test
