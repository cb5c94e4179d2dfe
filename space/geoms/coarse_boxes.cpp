#include <algorithm>

#include "space/base/floating_point.h"
#include "space/base/round_to_floats.h"
#include "space/base/tuning.h"
#include "space/geoms/geom_update.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

bool floatsOverlap(const Box& a, const Box& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(a.lower[axis] <= b.upper[axis] && b.lower[axis] <= a.upper[axis])) return false;
  return true;
}

}  // namespace

// In the order of their lower bounds on the axis on which these differ most. No order of slots
// shows in multiples of the golden ratio.
void CoarseBoxes::take(dxGeom* const* geoms, const Buffer<SlotState>& states, std::size_t coarse) {
  const double share =
      std::min(1.0, static_cast<double>(most_sampled) / static_cast<double>(coarse));
  const auto limit = static_cast<std::uint32_t>(share * 0xffffffffu);
  sample_.clear();
  for (std::size_t slot = 0; slot < states.size(); ++slot) {
    if (!(states[slot] & coarse_state) || static_cast<Slot>(slot) * 0x9e3779b9u > limit) continue;
    sample_.push_back({{}, geoms[slot]});
    roundToFloats(geoms[slot]->aabb, sample_.back().box);
  }
  if (sample_.empty()) return;
  float widest = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(
        sample_.begin(), sample_.end(),
        [=](const Sampled& a, const Sampled& b) { return a.box.lower[axis] < b.box.lower[axis]; });
    const float width = most->box.lower[axis] - least->box.lower[axis];
    if (!(width > widest)) continue;
    widest = width;
    axis_ = axis;
  }
  std::sort(sample_.begin(), sample_.end(), [this](const Sampled& a, const Sampled& b) {
    return a.box.lower[axis_] < b.box.lower[axis_];
  });
}

bool CoarseBoxes::overlapInVain(dxGeom* const* geoms, const Buffer<SlotState>& states,
                                std::size_t coarse, std::size_t most) {
  if (answer_ && !areManyMore(coarse) && ++age_ < retry_frames) return true;
  age_ = 0;
  sampled_of_ = coarse;
  answer_ = false;
  if (coarse * coarse / 2 <= most) return false;
  const ScopedMode exact(exactMode());
  take(geoms, states, coarse);
  const double share = static_cast<double>(sample_.size()) / static_cast<double>(coarse);
  const double most_sampled_pairs = static_cast<double>(most) * share * share;
  std::size_t in_vain = 0;
  for (auto a = sample_.begin(); a != sample_.end(); ++a)
    for (auto b = a + 1; b != sample_.end() && b->box.lower[axis_] <= a->box.upper[axis_]; ++b) {
      in_vain += floatsOverlap(a->box, b->box) && !boxesOverlap(a->geom, b->geom);
      if (static_cast<double>(in_vain) > most_sampled_pairs) return answer_ = true;
    }
  return false;
}

}  // namespace ode_parallel_sap
