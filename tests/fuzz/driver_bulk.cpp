// Pairs in bulk.
#include <map>
#include <mutex>
#include <thread>

#include "driver.h"

namespace sap_test {
namespace {

struct Stop {};

struct Blocks {
  std::mutex lock;
  std::map<std::size_t, Pairs> at;
  bool concurrent;
  std::size_t throws_at;  // the number of a block
  unsigned mode;
  std::size_t pairs = 0;
  bool wrong = false;
  const std::thread::id caller = std::this_thread::get_id();

  void operator()(const dParallelSAPPair* block, std::size_t count, std::size_t first) {
    const std::lock_guard<std::mutex> guard(lock);
    const bool in_turn = first == pairs && std::this_thread::get_id() == caller;
    wrong = wrong || count == 0 || at.count(first) || !(concurrent || in_turn) ||
            FloatingPointMode::current() != mode;
    pairs += count;
    for (std::size_t i = 0; i < count; ++i) record(&at[first], block[i].o1, block[i].o2);
    if (at.size() == throws_at) throw Stop();
  }
  // All but the last have one size, in each frame the same.
  Pairs joined() const {
    static std::size_t size = 0;
    if (at.size() > 1) size = std::max(size, at.begin()->second.size());
    Pairs pairs;
    for (const auto& [first, block] : at) {
      const bool last = first == at.rbegin()->first;
      if (first != pairs.size() || (last ? size && block.size() > size : block.size() != size))
        return {};
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
  blocks.concurrent = flags != 0;
  blocks.throws_at = decisions_.chance(64) ? 1 + decisions_.below(4) : 0;
  log("blocks of " + std::to_string(space) + " by " + std::to_string(some_threads) +
      " threads, flags " + std::to_string(flags) + ", throwing at " +
      std::to_string(blocks.throws_at));
  dParallelSAPSpaceSetNumThreads(id, some_threads);
  bool finished = true;
  try {
    const FloatingPointMode scoped(mode());
    blocks.mode = FloatingPointMode::current();
    dParallelSAPSpaceCollidePairs(id, &blocks, flags, invoke<Blocks>);
  } catch (const Stop&) {
    finished = false;
  }
  dParallelSAPSpaceSetNumThreads(id, usual_threads);
  compare(space, finished ? blocks.joined() : collide(id));
  if (blocks.wrong) fail("blocks that are empty, come twice, out of turn or in another mode");
}

}  // namespace sap_test
