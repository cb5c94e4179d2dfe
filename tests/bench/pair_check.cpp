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

// Slabs are of y, and swept along x. A pair counts in the slab where its intersection begins.
Overlapping overlapping(const Boxes& before, const Boxes& boxes) {
  std::vector<dReal> lows, borders;
  for (const CentredBox& box : boxes) lows.push_back(box.low(1));
  std::sort(lows.begin(), lows.end());
  const std::size_t slabs = static_cast<std::size_t>(std::cbrt(static_cast<double>(boxes.size())));
  for (std::size_t i = 1; i < slabs; ++i) borders.push_back(lows[i * lows.size() / slabs]);
  const auto slabOf = [&](dReal y) {
    return static_cast<std::size_t>(std::upper_bound(borders.begin(), borders.end(), y) -
                                    borders.begin());
  };

  std::vector<std::size_t> by_x(boxes.size());
  std::iota(by_x.begin(), by_x.end(), std::size_t{0});
  std::sort(by_x.begin(), by_x.end(),
            [&](std::size_t a, std::size_t b) { return boxes[a].low(0) < boxes[b].low(0); });
  std::vector<std::vector<std::size_t>> members(borders.size() + 1);
  for (const std::size_t i : by_x)
    for (std::size_t s = slabOf(boxes[i].low(1)); s <= slabOf(boxes[i].high(1)); ++s)
      members[s].push_back(i);
  Overlapping pairs;
  for (std::size_t s = 0; s < members.size(); ++s)
    for (auto i = members[s].begin(); i != members[s].end(); ++i)
      for (auto j = i + 1; j != members[s].end(); ++j) {
        const CentredBox &box = boxes[*i], &other = boxes[*j];
        if (other.low(0) > box.high(0)) break;
        if (!box.overlaps(other) || slabOf(std::max(box.low(1), other.low(1))) != s) continue;
        pairs.all.add(*i, *j);
        if (!(box == before[*i]) || !(other == before[*j])) pairs.of_moved.add(*i, *j);
      }
  return pairs;
}

std::string faultOf(Peer& peer, const Boxes& boxes, const PairSet& expected, bool superset_allowed,
                    std::size_t& extra) {
  PairSet found;
  const PairVisitor visitor = [&](std::size_t a, std::size_t b) {
    if (a != b && a < boxes.size() && b < boxes.size() && boxes[a].overlaps(boxes[b]))
      found.add(a, b);
    else
      ++extra;
  };
  peer.find(&visitor);
  if (extra > 0 && !superset_allowed)
    return "wrong: " + std::to_string(extra) + " pairs that do not overlap";
  if (found.count == expected.count && found.sum == expected.sum) return "";
  return "wrong: " + std::to_string(found.count) + " pairs instead of " +
         std::to_string(expected.count);
}

}  // namespace bench
