// Pairs in bulk: blocks, and which pairs began and ended.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "../support/events_oracle.h"
#include "driver.h"

namespace sap_test {
namespace {

struct Stop {};

struct Blocks {
  std::mutex lock;
  std::map<std::size_t, Pairs> at;
  std::size_t throws_at;  // the number of a block

  static void take(void* data, const dParallelSAPPair* pairs, std::size_t count,
                   std::size_t first) {
    Blocks& self = *static_cast<Blocks*>(data);
    const std::lock_guard<std::mutex> guard(self.lock);
    Pairs& block = self.at[first];
    for (std::size_t i = 0; i < count; ++i) record(&block, pairs[i].o1, pairs[i].o2);
    if (self.at.size() == self.throws_at) throw Stop();
  }
  Pairs joined() const {
    Pairs pairs;
    for (const auto& [first, block] : at) {
      if (first != pairs.size()) return {};  // not whole
      pairs.insert(pairs.end(), block.begin(), block.end());
    }
    return pairs;
  }
};

}  // namespace

void Driver::collideBlocks() {
  const int space = pickOurSpace();
  const dSpaceID id = spaceOf(space);
  const int usual_threads = dParallelSAPSpaceGetNumThreads(id);
  const int threads[] = {1, 2, 3, 7, usual_threads};
  const int some_threads = threads[decisions_.below(std::size(threads))];
  const int flags = decisions_.chance(128) ? dParallelSAPPairsConcurrent : 0;
  Blocks blocks;
  blocks.throws_at = decisions_.chance(64) ? 1 + decisions_.below(4) : 0;
  log("blocks of " + std::to_string(space) + " by " + std::to_string(some_threads) +
      " threads, flags " + std::to_string(flags) + ", throwing at " +
      std::to_string(blocks.throws_at));
  dParallelSAPSpaceSetNumThreads(id, some_threads);
  bool finished = true;
  try {
    const FloatingPointMode scoped(mode());
    dParallelSAPSpaceCollidePairs(id, &blocks, flags, Blocks::take);
  } catch (const Stop&) {
    finished = false;
  }
  dParallelSAPSpaceSetNumThreads(id, usual_threads);
  compare(space, finished ? blocks.joined() : collide(id));
}

// What can be said about numbers after any complete frame.
std::string Driver::problemOfNumbers(int space, const Pairs& got) const {
  const dSpaceID id = spaceOf(space);
  if (!objects_[space].ours || !dParallelSAPSpaceGetEvents(id)) return "";
  // Of two frames within a tolerance one may have reported more.
  if (dParallelSAPSpaceGetTolerance(spaceOf(space)) > 0) return "";
  std::vector<unsigned> numbers = numbersOf(id);
  if (numbers.size() != got.size()) return "not a number for each pair";
  std::sort(numbers.begin(), numbers.end());
  if (std::adjacent_find(numbers.begin(), numbers.end()) != numbers.end())
    return "two pairs with one number";
  return "";
}

// By numbers that change when a geom is added again.
Pairs Driver::pairsByAdding(const Pairs& got) const {
  Pairs pairs;
  for (const Pair& pair : got)
    pairs.emplace_back(objects_[pair.first].added, objects_[pair.second].added);
  return pairs;
}

// Frames of one space in which geoms move, come, go and come back, against the oracle.
void Driver::collideWithEvents() {
  const int space = pickOurSpace();
  const dSpaceID id = spaceOf(space);
  const std::size_t frames = 2 + decisions_.below(8);
  const double parts[] = {0, 0.001, 0.01, 0.1, 0.5};
  const double part = parts[decisions_.below(std::size(parts))];
  const bool stays_on = decisions_.chance(160);
  Random random = decisions_.random();
  log(std::to_string(frames) + " frames of " + std::to_string(space) + " with events, changing " +
      std::to_string(part));
  dParallelSAPSpaceSetEvents(id, 1);
  const bool traced = frames % 2 != 0;  // written to nowhere, the same pairs all the same
  if (traced) dParallelSAPSpaceSetTrace(id, "/dev/null", 1 + static_cast<int>(frames % 3));
  EventsOracle oracle;
  oracle.adopt(id, pairsByAdding(collide(id)));
  for (std::size_t frame = 0; frame < frames && problem_.empty(); ++frame) {
    const std::vector<int> members = objects_[space].members;
    for (const int member : members)
      if (objects_[member].kind != kSpace && random.chance(part)) changeForEvents(member, random);
    const Pairs got = collide(id);
    compare(space, got);
    EventsOracle::Geoms geoms;
    for (const int member : objects_[space].members)
      geoms[objects_[member].added] = objects_[member].geom;
    const std::string problem = oracle.check(id, pairsByAdding(got), geoms);
    if (!problem.empty()) fail("events of space " + std::to_string(space) + ": " + problem);
  }
  if (stays_on) return;
  dParallelSAPSpaceSetEvents(id, 0);
  dParallelSAPSpaceSetTrace(id, nullptr, 0);
}

void Driver::changeForEvents(int member, Random& random) {
  ++changes_;
  const int space = objects_[member].parent;
  const std::size_t what = random.below(6);
  if (what == 0) {
    (random.chance(0.5) ? dGeomEnable : dGeomDisable)(objects_[member].geom);
  } else if (what == 1) {
    remove(member);
    add(member, space);
  } else if (what == 2 && objects_[member].body == kNone) {
    destroy(member);
    if (random.chance(0.8)) {
      const int leaf = createLeaf(random.chance(0.5) ? kBox : kSphere, random);
      place(leaf, random, 0);
      add(leaf, space);
    }
  } else {
    place(member, random, random.below(4));
  }
}

}  // namespace sap_test
