#include "space/paper/endpoint_lists.h"

#include <algorithm>
#include <cstring>

#include "space/base/float_steps.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/pairs/radix_sort.h"

namespace ode_parallel_sap {

namespace {

// A newcomer passes half of all end points: more than one in so many boxes, and all are sorted
// anew.
constexpr std::size_t least_members_a_newcomer = 1024;

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

Endpoint<float> makeEndpoint(float value, std::uint32_t id) {
  return {std::uint64_t{orderOf(value)} << 32 | id};
}
Endpoint<double> makeEndpoint(double value, std::uint32_t id) {
  return {orderOf(value), id};
}

template <class Real>
Endpoint<Real> endpointOf(const BasicBox<Real>* boxes, std::uint32_t id, int axis) {
  const BasicBox<Real>& box = boxes[id & slot_mask];
  return makeEndpoint(id & upper_flag ? box.upper[axis] : box.lower[axis], id);
}

// Records that come by ascending slot keep that order where the rest is equal.
void sortEndpoints(Buffer<Endpoint<float>>& endpoints, Buffer<Endpoint<float>>& scratch) {
  static_assert(sizeof(Endpoint<float>) == sizeof(std::uint64_t), "sorted as plain words");
  scratch.resizeDiscarding(endpoints.size());
  if (endpoints.size())
    radixSort(&endpoints.data()->word, &scratch.data()->word, endpoints.size(), 31, 33);
}
void sortEndpoints(Buffer<Endpoint<double>>& endpoints, Buffer<Endpoint<double>>&) {
  std::sort(endpoints.begin(), endpoints.end());
}

Region sorting("end points: axes");

// End points may move by a place on average before sorting anew is faster (20,000 boxes on one
// core: 1.4 ms where nothing moves, 1.85 at half a place, 2.15 at one, 1.95 sorted anew). False if
// it gave up; the end points are all there in any case.
template <class Real>
bool insertionSort(Buffer<Endpoint<Real>>& endpoints) {
  Endpoint<Real>* const all = endpoints.data();
  const std::size_t count = endpoints.size();
  std::size_t places_left = count;
  for (std::size_t i = 1; i < count; ++i) {
    if (!(all[i] < all[i - 1])) continue;
    const Endpoint<Real> moving = all[i];
    std::size_t place = i;
    do {
      all[place] = all[place - 1];
      --place;
    } while (place > 0 && moving < all[place - 1]);
    all[place] = moving;
    if (i - place > places_left) return false;
    places_left -= i - place;
  }
  return true;
}

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

// Finds the slots that the lists do not hold yet, and notes which they are to hold.
template <class Real>
void EndpointLists<Real>::compareMembers(const BasicBox<Real>* boxes, std::size_t slots) {
  const std::size_t before = listed_.size();
  listed_.resize(slots);
  if (slots > before) std::memset(listed_.data() + before, 0, slots - before);
  newcomers_.resizeDiscarding(0);
  members_ = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const bool active = isActive(boxes[slot]);
    if (active && !listed_[slot]) newcomers_.push_back(static_cast<Slot>(slot));
    listed_[slot] = active;
    members_ += active;
  }
}

template <class Real>
bool EndpointLists<Real>::repair(const BasicBox<Real>* boxes, int axis) {
  Buffer<Endpoint<Real>>& endpoints = axes_[axis].endpoints;
  std::size_t kept = 0;
  for (const Endpoint<Real>& endpoint : endpoints) {
    const std::uint32_t id = endpoint.id(), slot = id & slot_mask;
    if (slot < listed_.size() && listed_[slot]) endpoints[kept++] = endpointOf(boxes, id, axis);
  }
  endpoints.resize(kept);
  for (const Slot slot : newcomers_) {
    endpoints.push_back(endpointOf(boxes, slot, axis));
    endpoints.push_back(endpointOf(boxes, slot | upper_flag, axis));
  }
  return insertionSort(endpoints);
}

template <class Real>
void EndpointLists<Real>::sortAnew(const BasicBox<Real>* boxes, int axis) {
  Buffer<Endpoint<Real>>& endpoints = axes_[axis].endpoints;
  endpoints.resizeDiscarding(2 * members_);
  std::size_t count = 0;
  for (std::size_t slot = 0; slot < listed_.size(); ++slot) {
    if (!listed_[slot]) continue;
    const std::uint32_t id = static_cast<std::uint32_t>(slot);
    endpoints[count++] = endpointOf(boxes, id, axis);
    endpoints[count++] = endpointOf(boxes, id | upper_flag, axis);
  }
  sortEndpoints(endpoints, axes_[axis].scratch);
}

template <class Real>
void EndpointLists<Real>::rank(int axis) {
  AxisRows& rows = axes_[axis].rows;
  rows.order.resizeDiscarding(members_);
  rows.ranks.resizeDiscarding(listed_.size());
  rows.reach.resizeDiscarding(members_);
  const Buffer<Endpoint<Real>>& endpoints = axes_[axis].endpoints;
  std::uint32_t lowers = 0;
  for (const Endpoint<Real>& endpoint : endpoints) {
    const std::uint32_t id = endpoint.id();
    if (id & upper_flag) continue;
    rows.ranks[id] = lowers;
    rows.order[lowers++] = id;
  }
  // On its own, as an inverted box's upper bound comes before its rank is known.
  lowers = 0;
  for (const Endpoint<Real>& endpoint : endpoints) {
    const std::uint32_t id = endpoint.id();
    if (id & upper_flag)
      rows.reach[rows.ranks[id & slot_mask]] = lowers;
    else
      ++lowers;
  }
  rows.layOut();
}

template <class Real>
void EndpointLists<Real>::update(const BoxSet& boxes, int threads) {
  const BasicBox<Real>* const all = boxesOf<Real>(boxes);
  // Should memory end on the way, nothing of what is there is used again.
  if (!complete_) listed_.resize(0);
  complete_ = false;
  compareMembers(all, boxes.size);
  const bool repairable = newcomers_.size() <= members_ / least_members_a_newcomer;
  const int most = teamFor(members_, grains::sorted_members, threads);
  runTeam(sorting, most, [&](int thread, int team) {
    for (int axis = thread; axis < 3; axis += team) {
      noteWork();
      int& anew_for = axes_[axis].anew_for;
      if (anew_for > 0 || !repairable) {
        if (anew_for > 0) --anew_for;
        sortAnew(all, axis);
      } else if (!repair(all, axis)) {
        anew_for = retry_frames;
        sortAnew(all, axis);
      }
      rank(axis);
    }
  });
  complete_ = true;
}

template class EndpointLists<float>;
template class EndpointLists<double>;

}  // namespace ode_parallel_sap
