// Frames of one space in a row, in which its geoms rest, move, drift or tremble and change, or the
// world steps.
#include "driver.h"

namespace sap_test {
namespace {

// Whether all that has begun is known to the first callback, which throws.
bool knowsEventsAtFirstPair(dSpaceID space) {
  struct Stop {};
  Events seen;
  try {
    collide(space, [&](dGeomID, dGeomID) {
      seen = begunOf(space);
      throw Stop();
    });
    return true;
  } catch (const Stop&) {
    return seen == begunOf(space);
  }
}

}  // namespace

// Of so many boxes a look at some tells how far all move.
void Driver::fill(int space, Random& random) {
  constexpr std::size_t kFewest = 100;
  while (objects_[space].members.size() < kFewest && alive_.size() < most_geoms_) {
    const int leaf = createLeaf(random.chance(0.5) ? kBox : kSphere, random);
    place(leaf, 0, random);
    add(leaf, space);
    ++changes_;
  }
}

// Each geom in a direction of its own.
void Driver::driftAll(int space, double distance) {
  for (const int member : objects_[space].members) {
    if (objects_[member].kind >= kPlane) continue;
    Random way(static_cast<std::uint64_t>(member));
    const auto shift = [&] { return way.between(-distance, distance); };
    const double x = shift(), y = shift();
    moveBy(objects_[member].geom, x, y, shift());
    ++changes_;
  }
}

// All by the same move, and each geom by up to this share of its least extent along each axis; a
// part of them far. What has no extent stays: it has no room either. So do rays, of which many lie
// along an axis.
void Driver::trembleAll(int space, double share, double leaving, double together, Random& random) {
  for (const int member : objects_[space].members) {
    if (objects_[member].kind >= kRay) continue;
    const dGeomID geom = objects_[member].geom;
    const Bounds bounds = boundsOf(geom);
    double least = 2;
    for (int axis = 0; axis < 3; ++axis)
      least = std::min(least, static_cast<double>(bounds[2 * axis + 1] - bounds[2 * axis]));
    if (!(least > 0)) continue;
    const double distance = random.chance(leaving) ? 0.3 : share * least;
    const auto shift = [&](int way) {
      return way * together + random.between(-distance, distance);
    };
    const double x = shift(-1), y = shift(0);
    moveBy(geom, x, y, shift(1));
    ++changes_;
  }
}

// Others come after the last geoms, or these go.
void Driver::changeLast(int space, Random& random) {
  const std::vector<int> members = objects_[space].members;
  const std::size_t count = std::min<std::size_t>(1 + random.below(3), members.size());
  const bool come = random.chance(0.5);
  for (std::size_t i = 0; i < count; ++i) {
    if (!come) {
      destroyLeaf(members[members.size() - 1 - i], 0, random);
      continue;
    }
    const int leaf = createLeaf(kBox, random);
    place(leaf, 0, random);
    add(leaf, space);
  }
}

// By numbers that change when a geom leaves a space of ours.
Pairs Driver::pairsByStay(const Pairs& got) const {
  Pairs pairs;
  for (const Pair& pair : got)
    pairs.emplace_back(objects_[pair.first].stay, objects_[pair.second].stay);
  return pairs;
}

// The members of a space, or the geoms within these.
void Driver::addGeoms(int space, bool deep, EventsOracle::Geoms& geoms) const {
  for (const int member : objects_[space].members) {
    if (!deep) geoms[objects_[member].stay] = objects_[member].geom;
    if (!deep || objects_[member].kind != kSpace) continue;
    addGeoms(member, false, geoms);
    addGeoms(member, true, geoms);
  }
}

// What can be said about numbers after any complete frame.
std::string Driver::problemOfNumbers(int space, const Pairs& got) const {
  const dSpaceID id = spaceOf(space);
  if (!objects_[space].ours || !(dParallelSAPSpaceGetEvents(id) & dParallelSAPEventPairs))
    return "";
  // Of two frames within a tolerance one may have reported more.
  if (dParallelSAPSpaceGetTolerance(id) > 0) return "";
  std::vector<unsigned> numbers = numbersOf(id);
  if (numbers.size() != got.size()) return "not a number for each pair";
  std::sort(numbers.begin(), numbers.end());
  if (std::adjacent_find(numbers.begin(), numbers.end()) != numbers.end())
    return "two pairs with one number";
  return "";
}

// By the rules alone, which leave no choice without a tolerance and culled planes.
Pairs Driver::owedPairs(int space) const {
  const Rules rules = Rules::of(spaceOf(space));
  Pairs owed;
  for (const Pair& pair : expectedPairs(membersOf(space)))
    if (restOf(rules, objects_[pair.first].geom, objects_[pair.second].geom) == Rest::no)
      owed.push_back(pair);
  return owed;
}

void Driver::checkEvents(int space, const Pairs& got, EventsOracle& oracle) {
  EventsOracle::Geoms geoms;
  addGeoms(space, false, geoms);
  const std::string problem = oracle.check(spaceOf(space), pairsByStay(got), geoms);
  if (!problem.empty()) fail("events of space " + std::to_string(space) + ": " + problem);
}

// Trembling by the sweep, so that small scenes keep candidates too, and without a tolerance, which
// has room for boxes itself. With events at times, and with a trace that is written to nowhere.
void Driver::collideFrames() {
  enum Motion { kSome, kSomeByLittle, kDrift, kTremble, kStep };
  const Motion motion = static_cast<Motion>(decisions_.below(5));
  const int space = motion == kTremble || decisions_.chance(128) ? pickOurSpace() : pickSpace();
  const dSpaceID id = spaceOf(space);
  const std::size_t frames = 1 + decisions_.below(10);
  const double distances[] = {0.001, 0.004, 0.012, 0.1}, parts[] = {0, 0.002, 0.01, 0.1, 0.5, 1};
  const double distance = distances[decisions_.below(motion == kTremble ? 3 : 4)];
  const double moving = parts[decisions_.below(motion >= kTremble ? 3 : 6)];
  const double changing = parts[decisions_.below(motion >= kTremble ? 3 : 5)];
  int events =
      objects_[space].ours && decisions_.chance(96) ? 1 + static_cast<int>(decisions_.below(3)) : 0;
  // Where rounding decides whether a culled pair rests, only its event tells.
  if (events && dParallelSAPSpaceGetCullPlanes(id)) events |= dParallelSAPEventPairs;
  const bool events_stay = decisions_.chance(160);
  const double together = decisions_.chance(96) ? (decisions_.chance(128) ? 0.1 : 30) : 0;
  Random random = decisions_.random();
  if (motion == kTremble) fill(space, random);
  log(std::to_string(frames) + " frames of " + std::to_string(space) + ", motion " +
      std::to_string(motion) + " by " + std::to_string(distance) + ", moving " +
      std::to_string(moving) + ", together " + std::to_string(together) + ", changing " +
      std::to_string(changing) + ", events " + std::to_string(events));
  const int method = motion == kTremble ? dParallelSAPSpaceGetMethod(id) : 0;
  const dReal tolerance = motion == kTremble ? dParallelSAPSpaceGetTolerance(id) : 0;
  if (motion == kTremble) {
    dParallelSAPSpaceSetMethod(id, dParallelSAPMethodSweep);
    dParallelSAPSpaceSetTolerance(id, 0);
  }
  EventsOracle oracle;
  if (events) {
    dParallelSAPSpaceSetEvents(id, 0);
    dParallelSAPSpaceSetEvents(id, events);
    if (frames % 2) dParallelSAPSpaceSetTrace(id, "/dev/null", 1 + static_cast<int>(frames % 3));
    checkEvents(space, collide(id), oracle);
  }
  for (std::size_t frame = 0; frame < frames && problem_.empty(); ++frame) {
    if (motion == kDrift) driftAll(space, distance);
    if (motion == kTremble) trembleAll(space, distance, moving, together, random);
    if (motion == kTremble && random.chance(0.2)) changeLast(space, random);
    if (motion == kStep) stepBodies(moving, 9, random);
    for (const int member : objects_[space].members)
      if (motion <= kSomeByLittle && random.chance(moving)) place(member, motion * 2, random);
    for (const int object : within(space)) {
      if (random.chance(changing)) changeAnyhow(object, random);
      if (changing == 0 && objects_[object].kind == kUser) changeUnasked(object, 0, random);
    }
    const std::size_t settings[] = {1, 2, 4, 4, 5, 6};
    if (events && motion != kTremble && random.chance(0.2))
      change(space, settings[random.below(std::size(settings))], random.below(6));
    if (events & dParallelSAPEventTouches && random.chance(0.5)) {
      collideTouching(space, oracle, random);
    } else {
      const bool is_told = !events || random.chance(0.7) || dParallelSAPSpaceGetTolerance(id) > 0 ||
                           dParallelSAPSpaceGetCullPlanes(id);
      const bool throws = !is_told && random.chance(0.5);
      Pairs got;
      if (!objects_[space].ours) announceMeshes();
      {
        const FloatingPointMode scoped(mode());
        if (is_told)
          got = collide(id);
        else if (throws && !knowsEventsAtFirstPair(id))
          fail("events that the first pair's callback did not know");
        else if (!throws)
          dParallelSAPSpaceCollidePairs(id, nullptr, random.chance(0.5), nullptr);
      }
      if (!is_told) got = owedPairs(space);
      compare(space, got, !throws);
      if (events) checkEvents(space, got, oracle);
      if (events && !(begunTouchesOf(id).empty() && endedTouchesOf(id).empty()))
        fail("touches changed without contacts");
    }
    if (motion != kTremble) continue;
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(id, &stats);
    trembling_ += stats.backend == dParallelSAPBackendCPU;  // GPUs keep none
    candidates_kept_ += stats.candidates_kept > 0;
  }
  if (motion == kTremble) {
    dParallelSAPSpaceSetMethod(id, method);
    dParallelSAPSpaceSetTolerance(id, tolerance);
  }
  if (!events || events_stay) return;
  dParallelSAPSpaceSetEvents(id, 0);
  dParallelSAPSpaceSetTrace(id, nullptr, 0);
  if (!begunOf(id).empty() || !endedOf(id).empty() || !numbersOf(id).empty())
    fail("events that are off are told");
}

}  // namespace sap_test
