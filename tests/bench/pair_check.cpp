#include "pair_check.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bench {

void PairSet::add(std::size_t a, std::size_t b) {
  if (a > b) std::swap(a, b);
  std::uint64_t z = (static_cast<std::uint64_t>(a) << 32 | b) + 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  sum += z ^ (z >> 31);
  ++count;
}

Reported reportedBy(Peer& peer, const Boxes& boxes) {
  Reported reported;
  peer.visit([&](std::size_t a, std::size_t b) {
    if (a != b && a < boxes.size() && b < boxes.size() && boxes[a].overlaps(boxes[b]))
      reported.pairs.add(a, b);
    else
      ++reported.extra;
  });
  return reported;
}

void Overlapping::add(std::size_t a, std::size_t b, const std::vector<bool>& moved) {
  all.add(a, b);
  if (moved[a] || moved[b]) of_moved.add(a, b);
}

namespace {

// Along x, among the boxes that reach into a slab of y from `low` to below `high`; a pair counts in
// the slab where its intersection begins.
template <class Add>
void sweepSlab(const Boxes& boxes, const std::vector<std::size_t>& by_x, dReal low, dReal high,
               Add add) {
  for (std::size_t i = 0; i < by_x.size(); ++i) {
    const CentredBox& box = boxes[by_x[i]];
    const dReal end = box.high(0);
    for (std::size_t j = i + 1; j < by_x.size() && boxes[by_x[j]].low(0) <= end; ++j) {
      const CentredBox& other = boxes[by_x[j]];
      const dReal begin = std::max(box.low(1), other.low(1));
      if (begin >= low && begin < high && box.overlaps(other)) add(by_x[i], by_x[j]);
    }
  }
}

}  // namespace

Overlapping overlapping(const Boxes& boxes, const std::vector<bool>& moved) {
  std::vector<dReal> lows;
  for (const CentredBox& box : boxes) lows.push_back(box.low(1));
  std::sort(lows.begin(), lows.end());
  const std::size_t slabs = static_cast<std::size_t>(std::cbrt(static_cast<double>(boxes.size())));
  std::vector<dReal> borders{-std::numeric_limits<dReal>::infinity()};
  for (std::size_t i = 1; i < slabs; ++i) borders.push_back(lows[i * lows.size() / slabs]);
  borders.erase(std::unique(borders.begin(), borders.end()), borders.end());
  borders.push_back(std::numeric_limits<dReal>::infinity());

  std::vector<std::size_t> by_x(boxes.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  std::sort(by_x.begin(), by_x.end(),
            [&](std::size_t a, std::size_t b) { return boxes[a].low(0) < boxes[b].low(0); });
  const auto slabOf = [&](dReal y) {
    return static_cast<std::size_t>(std::upper_bound(borders.begin(), borders.end(), y) -
                                    borders.begin()) -
           1;
  };
  std::vector<std::vector<std::size_t>> members(borders.size() - 1);
  for (std::size_t i : by_x)
    for (std::size_t s = slabOf(boxes[i].low(1)); s <= slabOf(boxes[i].high(1)); ++s)
      members[s].push_back(i);
  Overlapping pairs;
  const auto add = [&](std::size_t a, std::size_t b) { pairs.add(a, b, moved); };
  for (std::size_t s = 0; s < members.size(); ++s)
    sweepSlab(boxes, members[s], borders[s], borders[s + 1], add);
  return pairs;
}

std::string faultOf(const Reported& reported, const PairSet& expected, bool superset_allowed) {
  if (reported.extra > 0 && !superset_allowed)
    return "wrong: " + std::to_string(reported.extra) + " pairs that do not overlap";
  if (reported.pairs == expected) return "";
  return "wrong: " + std::to_string(reported.pairs.count) + " pairs instead of " +
         std::to_string(expected.count);
}

}  // namespace bench
