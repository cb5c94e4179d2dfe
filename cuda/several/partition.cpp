#include "cuda/several/partition.h"

#include <algorithm>
#include <limits>

#include "space/data/tuning.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace ode_parallel_sap {

using device::clearly_fewer;
using device::few_copies;

namespace {

// fixed: enough that equal numbers of sampled boxes are equal numbers of boxes within 1 %.
constexpr std::size_t most_sampled = 2048;

// Spreads the sample within its steps: slots that follow a pattern would otherwise show a part of
// it only.
std::size_t scatter(std::size_t i) {
  std::uint64_t bits = (i + 1) * 0x9e3779b97f4a7c15u;
  bits = (bits ^ bits >> 29) * 0xbf58476d1ce4e5b9u;
  return bits >> 32;
}

// Bit i: values[i] < bound, of 32 values.
std::uint32_t below(const std::int32_t* values, std::int32_t bound) {
  std::uint32_t bits = 0;
#if defined(__SSE2__)
  const __m128i bounds = _mm_set1_epi32(bound);
  const auto four = [&](int i) {
    return _mm_cmplt_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values + i)), bounds);
  };
  for (int i = 0; i < 32; i += 16) {
    const __m128i eight = _mm_packs_epi32(four(i), four(i + 4));
    const __m128i others = _mm_packs_epi32(four(i + 8), four(i + 12));
    bits |= static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(eight, others))) << i;
  }
#else
  for (int i = 0; i < 32; ++i) bits |= std::uint32_t{values[i] < bound} << i;
#endif
  return bits;
}

// Bit i: i < count.
std::uint32_t firstBits(std::size_t count) {
  return count < 32 ? (1u << count) - 1 : 0xffffffffu;
}

// fixed: the orders of NaN are beyond those of the infinities.
constexpr std::int32_t infinite_order = 0x7f800000;

}  // namespace

void DealtRow::add(int share, std::size_t word, std::uint32_t bits) {
  members[share][word] = bits;
  std::uint16_t* to = at[share] + count[share];
  for (; bits; bits &= bits - 1)
    *to++ = static_cast<std::uint16_t>(word * 32 + static_cast<std::size_t>(__builtin_ctz(bits)));
  count[share] = static_cast<std::size_t>(to - at[share]);
}

// As spanOf, but 32 boxes at a time against each cut: where a box is, no branch could precompute.
void DealtRow::sort(const BoxSet& boxes, std::size_t row, const Cuts& cuts) {
  const std::size_t begin = row * slots, size = std::min(boxes.size - begin, slots);
  const Box* const from = boxes.boxes.data() + begin;
  const int axis = cuts.axis, shares = cuts.shares;
  for (std::size_t i = 0; i < size; ++i) {
    low_[i] = stepNumber(from[i].lower[axis]);
    high_[i] = stepNumber(from[i].upper[axis]);
  }
  for (int share = 0; share < shares; ++share) count[share] = 0;
  for (std::size_t word = 0; word < slots / 32; ++word) {
    const std::size_t place = word * 32;
    const std::int32_t *const low = low_ + place, *const high = high_ + place;
    // Those that end in this share or behind it, and those that begin behind it.
    std::uint32_t ends = firstBits(size - std::min(size, place)) & below(low, infinite_order + 1) &
                         ~below(low, -infinite_order);
    for (int share = 0; share + 1 < shares; ++share) {
      // Of equal bounds those are behind the cut that come at or after its slot.
      const std::int32_t order = cuts.orderAt(share);
      const std::size_t slot = cuts.slotAt(share), first = begin + place;
      const std::uint32_t before = firstBits(slot - std::min(slot, first));
      const std::int32_t next =
          order < std::numeric_limits<std::int32_t>::max() ? order + 1 : order;
      const std::uint32_t begins_behind = ~(below(low, order) | (below(low, next) & before));
      add(share, word, ends & ~begins_behind);
      ends &= begins_behind | ~below(high, order);
    }
    add(shares - 1, word, ends);
  }
}

void Partition::takeSample(const BoxSet& boxes) {
  const std::size_t count = std::min(boxes.size, most_sampled), step = boxes.size / count;
  const auto slotOf = [step](std::size_t i) {
    return i * step + (step > 1 ? scatter(i) % step : 0);
  };
  sample_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    if (i + prefetch_distance < count)
      __builtin_prefetch(&boxes.boxes[slotOf(i + prefetch_distance)]);
    const std::size_t slot = slotOf(i);
    if (isActive(boxes.boxes[slot]))
      sample_.push_back({boxes.boxes[slot], static_cast<Slot>(slot)});
  }
}

void Partition::order(int axis) {
  places_.clear();
  for (const Sample& s : sample_) places_.push_back(placeOf(s.box.lower[axis], s.slot));
  std::sort(places_.begin(), places_.end());
}

// Equal parts of the ordered sample.
void Partition::cut(int axis, int shares, bool weighted) {
  cuts_.axis = axis;
  cuts_.shares = shares;
  const auto weightOf = [&](Place place) {
    return weighted ? density_[last_cuts_.shareOf(place)] : 1.0;
  };
  double all = 0, sum = 0;
  for (const Place place : places_) all += weightOf(place);
  int made = 0;
  for (const Place place : places_) {
    for (; made + 1 < shares && sum >= all * (made + 1) / shares; ++made) cuts_.at[made] = place;
    sum += weightOf(place);
  }
  for (; made + 1 < shares; ++made) cuts_.at[made] = ~Place{0};
}

std::size_t Partition::copies(const Cuts& cuts) const {
  std::size_t copies = 0;
  for (const Sample& s : sample_) {
    const Span span = spanOf(s.box, s.slot, cuts);
    copies += static_cast<std::size_t>(span.last - span.first);
  }
  return copies;
}

// The axis whose equal parts cut through the fewest boxes.
int Partition::bestAxis(int shares) {
  int best = cuts_.axis;
  double fewest = 0;
  for (int i = 0; i < 3; ++i) {
    const int axis = (last_cuts_.axis + i) % 3;
    order(axis);
    cut(axis, shares, false);
    const double cut_through = static_cast<double>(copies(cuts_));
    if (i > 0 && cut_through >= clearly_fewer * fewest) continue;
    best = axis;
    fewest = cut_through;
  }
  return best;
}

const Cuts& Partition::plan(const BoxSet& boxes, int shares) {
  takeSample(boxes);
  const int axis = last_cuts_.axis;
  bool weighted = learnt_ && shares == last_cuts_.shares;
  order(axis);
  cut(axis, shares, weighted);
  if (!weighted || copies(cuts_) > sample_.size() / few_copies) {
    const int best = bestAxis(shares);
    weighted = weighted && best == axis;
    order(best);
    cut(best, shares, weighted);
  }
  for (double& mass : mass_) mass = 0;
  for (const Place place : places_) ++mass_[cuts_.shareOf(place)];
  last_cuts_ = cuts_;
  learnt_ = false;
  return cuts_;
}

void Partition::learn(const Work* work) {
  for (int share = 0; share < cuts_.shares; ++share)
    density_[share] = (work[share].cost() + 1) / std::max(mass_[share], 0.5);
  learnt_ = true;
}

}  // namespace ode_parallel_sap
