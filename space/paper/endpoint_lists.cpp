#include "space/paper/endpoint_lists.h"

#include <algorithm>

#include "space/base/float_steps.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

constexpr std::uint32_t upper_flag = std::uint32_t{1} << 31;
constexpr std::uint32_t slot_mask = upper_flag - 1;

// Integers in the order of the values, which are no NaN; the two zeros are one.
std::uint32_t orderOf(float value) {
  return static_cast<std::uint32_t>(ordered(value + 0.0f)) ^ 0x80000000u;  // makes one of the zeros
}
std::uint64_t orderOf(double value) {
  const std::uint64_t bits = bitsOf(value + 0.0);  // likewise
  return bits >> 63 ? ~bits : bits | std::uint64_t{1} << 63;
}

Region sorting("end points: axes");

}  // namespace

std::uint32_t AxisRows::rowOf(std::uint64_t place) const {
  return static_cast<std::uint32_t>(
      std::upper_bound(begins.data(), begins.data() + order.size(), place) - begins.data() - 1);
}

void AxisRows::layOut() {
  const std::size_t count = order.size();
  begins.resizeDiscarding(count + 1);
  inverted = false;
  std::uint64_t place = 0;
  for (std::size_t row = 0; row < count; ++row) {
    begins[row] = place;
    if (reach[row] > row + 1) place += reach[row] - row - 1;
    inverted |= reach[row] <= row;
  }
  begins[count] = place;
}

template <class Real>
void EndpointLists<Real>::sort(const BoxSet& boxes, int axis) {
  const BasicBox<Real>* const all = boxesOf<Real>(boxes);
  std::vector<Endpoint<Real>>& endpoints = axes_[axis].endpoints;
  endpoints.clear();
  endpoints.reserve(2 * boxes.size);
  for (std::size_t slot = 0; slot < boxes.size; ++slot) {
    if (!isActive(all[slot])) continue;
    const std::uint32_t id = static_cast<std::uint32_t>(slot);
    endpoints.emplace_back(orderOf(all[slot].lower[axis]), id);
    endpoints.emplace_back(orderOf(all[slot].upper[axis]), id | upper_flag);
  }
  std::sort(endpoints.begin(), endpoints.end());
}

template <class Real>
void EndpointLists<Real>::rank(std::size_t slots, int axis) {
  AxisRows& rows = axes_[axis].rows;
  const std::vector<Endpoint<Real>>& endpoints = axes_[axis].endpoints;
  rows.order.resizeDiscarding(endpoints.size() / 2);
  rows.ranks.resizeDiscarding(slots);
  rows.reach.resizeDiscarding(endpoints.size() / 2);
  std::uint32_t lowers = 0;
  for (const Endpoint<Real>& endpoint : endpoints) {
    const std::uint32_t id = endpoint.second;
    if (id & upper_flag) continue;
    rows.ranks[id] = lowers;
    rows.order[lowers++] = id;
  }
  // On its own, as an inverted box's upper bound comes before its rank is known.
  lowers = 0;
  for (const Endpoint<Real>& endpoint : endpoints) {
    const std::uint32_t id = endpoint.second;
    if (id & upper_flag)
      rows.reach[rows.ranks[id & slot_mask]] = lowers;
    else
      ++lowers;
  }
  rows.layOut();
}

template <class Real>
void EndpointLists<Real>::update(const BoxSet& boxes, int threads) {
  const int most = teamFor(boxes.size, grains::sorted_members, threads);
  runTeam(sorting, most, [&](int thread, int team) {
    for (int axis = thread; axis < 3; axis += team) {
      noteWork();
      sort(boxes, axis);
      rank(boxes.size, axis);
    }
  });
}

template class EndpointLists<float>;
template class EndpointLists<double>;

}  // namespace ode_parallel_sap
