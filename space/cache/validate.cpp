#include "space/base/validate.h"

#include <algorithm>
#include <iterator>

#include "space/base/floating_point.h"
#include "space/cache/fat_proxies.h"
#include "space/cache/pair_cache.h"
#include "space/cache/pair_events.h"
#include "space/geoms/pair_filter.h"

namespace ode_parallel_sap {

void FatProxies::validate(const BoxSet& boxes, const Sweep<float>& sweep) const {
  constexpr char invariant[] =
      "each box, less the shared move, lies in its fat box, with its filters, and candidates are "
      "all pairs of fat boxes";
  const ScopedMode mode(exactMode());
  candidates_.validate(fat_.size);
  if (sweep.holds(fat_)) sweep.trees().validate(fat_);
  mustHold(fat_.size == boxes.size, invariant);
  const Box move = moved();
  for (Slot slot = 0; slot < boxes.size; ++slot) {
    if (!isActive(boxes.boxes[slot])) continue;
    const Box box = movedBack(boxes.boxes[slot], move), &fat = fat_.boxes[slot];
    for (int axis = 0; axis < 3; ++axis)
      mustHold(fat.lower[axis] <= box.lower[axis] && box.upper[axis] <= fat.upper[axis], invariant);
    mustHold(!filtersChanged(boxes, slot), invariant);
  }
  const auto isPair = [&](Slot a, Slot b) {
    return overlap(fat_.boxes[a], fat_.boxes[b]) && passesFilters(fat_, a, b);
  };
  mustBePairs(candidates_, fat_.size, /*exactly=*/true, isPair, invariant);
}

void PairCache::validate(dxGeom* const* geoms, const GeomUpdate& update, const PairRules& rules,
                         const PairList& pairs) const {
  constexpr char invariant[] =
      "pairs are all that overlap and pass the filter, more with a tolerance, and no change is "
      "left";
  const ScopedMode mode(exactMode());
  const BoxSet& boxes = update.boxes();
  const PairFilter filter(geoms, update, rules);
  pairs.validate(boxes.size);
  mustHold(state_ == off || changed_.count() == 0, invariant);
  const auto isPair = [&](Slot a, Slot b) {
    if (!(boxes.wide ? overlap(boxes.wide_boxes[a], boxes.wide_boxes[b])
                     : overlap(boxes.boxes[a], boxes.boxes[b])) ||
        !passesFilters(boxes, a, b))
      return false;
    Pair pair = makePair(a, b) | borderline_bit;
    return filter.keep(&pair, &pair + 1) != &pair;
  };
  mustBePairs(pairs, boxes.size, /*exactly=*/rules.tolerance == 0, isPair, invariant);
}

void PairNumbers::validate(std::vector<Number> used) const {
  constexpr char invariant[] =
      "used numbers differ and are not free, and none below the lowest is free";
  std::sort(used.begin(), used.end());
  mustHold(std::adjacent_find(used.begin(), used.end()) == used.end(), invariant);
  for (const Number number : used)
    mustHold(number < unused_ && !given_back_.contains(number), invariant);
  mustHold(lowest_ <= unused_ && given_back_.firstFrom(0) >= lowest_, invariant);
}

void PairEvents::validate() const {
  constexpr char invariant[] =
      "pairs ascend, each has a touch if these are kept, and the numbers of those that did not "
      "begin are those that did not end";
  mustHold(!keeps_touches_ || previous_.touches.size() == previous_.pairs.size(), invariant);
  for (std::size_t place = 1; place < previous_.pairs.size(); ++place)
    mustHold(previous_.pairs[place - 1] < previous_.pairs[place], invariant);
  const auto stayed = [&](const NumberedPairs& list, const Buffer<Unreported>& resting,
                          const Buffer<Event>& events) {
    std::vector<Number> numbers(list.numbers.begin(), list.numbers.end()), changed, stayed;
    for (const Unreported& pair : resting) numbers.push_back(pair.number);
    for (const Event& event : events) changed.push_back(event.number);
    std::sort(numbers.begin(), numbers.end());
    std::sort(changed.begin(), changed.end());
    mustHold(std::includes(numbers.begin(), numbers.end(), changed.begin(), changed.end()),
             invariant);
    std::set_difference(numbers.begin(), numbers.end(), changed.begin(), changed.end(),
                        std::back_inserter(stayed));
    return stayed;
  };
  std::vector<Number> used = stayed(previous_, resting_, begun_);
  mustHold(stayed(next_, next_resting_, ended_) == used, invariant);  // those of before
  for (const Event& event : begun_) used.push_back(event.number);
  for (const Event& event : ended_) used.push_back(event.number);
  free_.validate(used);
}

}  // namespace ode_parallel_sap
