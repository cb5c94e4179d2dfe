// What is compared: something that finds the overlapping pairs of moving boxes.
//
// A frame is the same three steps for everybody:
//
//   move (boxes)   not timed: the user's own objects (geoms, proxies' boxes, ...) get new places
//   find (0)       timed: what the library needs to be up to date again, and all pairs
//   account ()     not timed: where the time of the last find went, if the library can tell
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "centred_box.h"

namespace bench {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

// What ran, as far as the library tells.
struct Account {
  double update = not_known, extract = not_known, filter = not_known, report = not_known;  // ms
  double own_bytes = not_known;  // memory by the library's own account
  int threads = 1, devices = 0;
};

// Receives the numbers of two boxes, in any order.
using PairVisitor = std::function<void(std::size_t, std::size_t)>;

class Peer {
 public:
  virtual ~Peer() = default;

  // Once, in this order: the user's objects, then what the library builds on them. Throws where
  // these boxes would end the program.
  virtual void create(const Boxes& boxes) = 0;
  virtual void enter() = 0;

  virtual void move(const Boxes& boxes) = 0;
  // The number of pairs. A visitor, in one find before those that are timed, receives them.
  virtual std::size_t find(const PairVisitor* visitor) = 0;

  virtual Account account() const { return {}; }
};

struct PeerKind {
  std::string name, library;  // with its version
  // Empty where it is not to be had on this machine.
  std::function<std::unique_ptr<Peer>(int threads)> create;
  // Why more pairs than the exact ones may be reported; empty: it reports exactly these.
  std::string superset = {};
  bool takes_threads = false;
  // Boxes beyond which not to try, whatever the time: memory, or a limit of the library.
  std::size_t most = std::numeric_limits<std::size_t>::max();
  bool leaves_out_rest = false;  // it finds no pairs of boxes that have both not moved
  bool chooses_threads = false;  // where told to use 0
};

// All that were built in: each file in peers/ adds its own before main().
std::vector<PeerKind>& peerKinds();

struct AddPeer {
  explicit AddPeer(const PeerKind& kind) { peerKinds().push_back(kind); }
};

}  // namespace bench
