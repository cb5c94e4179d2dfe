#include "space/frame/pair_sample.h"

#include <algorithm>

#include "space/geom/geom_tests.h"
#include "space/geom/plane_test.h"

namespace ode_parallel_sap {

namespace {

// Its misses of the cache, three readings of the clock: some 0.2 us a pair.
constexpr double ms_between_picks = 0.05;  // fixed: so that picking takes 0.4 % of the time

PackRules skipping(bool of_static) {
  PackRules rules;
  rules.skip_static = of_static;
  rules.skip_asleep = !of_static;
  return rules;
}

}  // namespace

PairSample::Kinds PairSample::kindsOf(const dxGeom* a, const dxGeom* b) {
  const ScopedMode mode(exactMode());
  const unsigned long of_a = a->category_bits, of_b = b->category_bits;
  return {isLeftOut(a, b, skipping(true)), isLeftOut(a, b, skipping(false)),
          areClearByPlane(const_cast<dxGeom*>(a), const_cast<dxGeom*>(b)), std::min(of_a, of_b),
          std::max(of_a, of_b)};
}

void PairSample::add(const Kinds& kinds, int contacts, double ms) {
  const double took = withoutOutliers(ms);
  const SampledPairs::Kind one = {1, contacts >= 0 ? 1u : 0u, contacts > 0 ? 1u : 0u, took,
                                  took * took};
  seen_.all.add(one);
  if (kinds.of_static) seen_.of_static.add(one);
  if (kinds.asleep) seen_.asleep.add(one);
  if (kinds.clear) seen_.clear.add(one);
  if (contacts == not_asked) return;
  if (contacts <= 0) ++seen_.untouched;
  seen_.addTo(kinds.a, kinds.b, one);
}

// Where another program had the core for a while, that would stand for thousands of pairs. Until
// the mean is known by some callbacks, it is that of others which do next to nothing: long ones
// count for less at first, but one that is interrupted among the first does not count for all.
double PairSample::withoutOutliers(double ms) const {
  constexpr double others = 16;         // fixed: the next few outweigh them
  constexpr double others_ms = 0.0001;  // fixed: what a call takes, and little else
  constexpr double most_means = 100;    // fixed: callbacks differ by no more, as a rule
  const double mean =
      (seen_.all.report_ms + others * others_ms) / (static_cast<double>(seen_.all.pairs) + others);
  return std::clamp(ms, 0.0, most_means * mean);
}

// Marsaglia's xorshift; from 1 to twice the average.
std::size_t PairSample::nextGap() {
  random_ ^= random_ << 13;
  random_ ^= random_ >> 17;
  random_ ^= random_ << 5;
  return 1 + static_cast<std::size_t>(2 * one_in_ * (random_ / 4294967296.0));
}

void PairSample::endFrame(unsigned long long pairs, double ms) {
  if (!on_) return;
  pairs_ += static_cast<double>(pairs);
  ms_ += ms;
  // Many short frames have one pick among them.
  if (ms_ < due_ms_) return;
  due_ms_ = ms_ + ms_between_picks;
  // What was picked too often or too rarely so far is made up for.
  constexpr double slack = 20;  // fixed: picks, of which chance may be the cause
  const double wanted = ms_ / ms_between_picks;
  if (wanted <= 0) return;
  const double excess =
      std::clamp((static_cast<double>(seen_.all.pairs) + slack) / (wanted + slack), 0.5, 2.0);
  const double one_in = std::clamp(pairs_ / wanted * excess, 1.0, 1e6);
  // Or the first pairs of frames would be picked too often where fewer are to be, and too rarely.
  next_ = static_cast<std::size_t>(static_cast<double>(next_) * one_in / one_in_);
  one_in_ = one_in;
}

}  // namespace ode_parallel_sap
