#include "space/base/pair_list.h"

#include "space/base/floating_point.h"
#include "space/base/parallel.h"

namespace ode_parallel_sap {

static Region deciding("pair list: exact tests");

void PairList::decide(const PairTest* test, int threads) {
  if (!test) return;
  const auto isOpen = [&](const Run& run) { return !run.decided || test->everyPair(); };
  std::size_t open = 0;
  for (const Run& run : runs)
    if (isOpen(run)) open += run.size();
  if (open == 0) return;
  const std::size_t most = chunkOf(open, chunk_pairs, threads);
  std::vector<Run> pieces;
  for (const Run& run : runs)
    for (Pair* first = run.first; first < run.last; first = pieces.back().last) {
      const std::size_t left = static_cast<std::size_t>(run.last - first);
      pieces.push_back({first, isOpen(run) ? first + std::min(most, left) : run.last, run.decided});
    }
  const ScopedMode mode(exactMode());
  runChunks(deciding, teamFor(open, grains::tested_pairs, threads), pieces.size(), 1,
            [&](const Range& range, int) {
              Run& piece = pieces[range.begin];
              if (isOpen(piece)) piece.last = test->keep(piece.first, piece.last);
              piece.decided = true;
            });
  runs.clear();
  for (const Run& piece : pieces) add(piece);
}

void PairList::closeGaps() {
  if (runs.size() < 2) return;
  Pair* end = runs[0].last;
  for (std::size_t run = 1; run < runs.size(); ++run)
    end = std::copy(runs[run].first, runs[run].last, end);
  runs = {{runs[0].first, end}};
}

}  // namespace ode_parallel_sap
