// Are the pairs right? Sets of pairs of any size are compared by their number and the sum of a hash
// of each pair, so that a missing, a wrong and a repeated pair all show.
#pragma once

#include <cstdint>
#include <string>

#include "peer.h"

namespace bench {

struct PairSet {
  std::size_t count = 0;
  std::uint64_t sum = 0;

  void add(std::size_t a, std::size_t b);
  bool operator==(const PairSet& other) const { return count == other.count && sum == other.sum; }
};

// What a peer reported: the pairs that overlap, and how many more.
struct Reported {
  PairSet pairs;
  std::size_t extra = 0;
};
Reported reportedBy(Peer& peer, const Boxes& boxes);

// By a way of its own, which shares no code with what is compared: a sweep in slabs of equally many
// boxes.
struct Overlapping {
  PairSet all, of_moved;  // the latter have a box that moved
  void add(std::size_t a, std::size_t b, const std::vector<bool>& moved);
};
Overlapping overlapping(const Boxes& boxes, const std::vector<bool>& moved);

// Empty if all is as it should be, else what is wrong.
std::string faultOf(const Reported& reported, const PairSet& expected, bool superset_allowed);

}  // namespace bench
