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
};

// By a way of its own, which shares no code with what is compared: a sweep in slabs of equally many
// boxes.
struct Overlapping {
  PairSet all, of_moved;  // the latter have a box that is another one than before
};
Overlapping overlapping(const Boxes& before, const Boxes& boxes);

// Empty if the peer finds the expected pairs, else what is wrong. `extra` becomes the number of
// others, which only a superset may have.
std::string faultOf(Peer& peer, const Boxes& boxes, const PairSet& expected, bool superset_allowed,
                    std::size_t& extra);

}  // namespace bench
