// What is compared: something that finds the overlapping pairs of moving boxes.
//
// A frame is the same three steps for everybody:
//
//   move (boxes)   not timed: the user's own objects (geoms, proxies' boxes, ...) get new places
//   find ()        timed: what the library needs to be up to date again, and all pairs
//   account ()     not timed: where the time of the last find went, if the library can tell
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "centred_box.h"

namespace bench {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

// Milliseconds; not_known where a library does not tell.
struct Stages {
  double update = not_known;
  double extract = not_known;
  double filter = not_known;
  double report = not_known;
};

// What ran, where that is the library's choice.
struct Account {
  Stages stages;
  double own_bytes = not_known;  // memory by the library's own account
  int threads = 1;
  int devices = 0;
};

// Receives the numbers of two boxes, in any order.
using PairVisitor = std::function<void(std::size_t, std::size_t)>;

class Peer {
 public:
  virtual ~Peer() = default;

  // Once, in this order: the user's objects, then what the library builds on them.
  virtual void create(const Boxes& boxes) = 0;
  virtual void enter() = 0;

  virtual void move(const Boxes& boxes) = 0;
  // The number of pairs.
  virtual std::size_t find() = 0;
  // The same, and what was found; not for timing.
  virtual void visit(const PairVisitor& visitor) = 0;

  virtual Account account() const { return {}; }
};

struct PeerKind {
  std::string name;
  std::string library;  // with its version
  bool takes_threads = false;
  bool chooses_threads = false;  // where told to use 0
  // Boxes beyond which not to try, whatever the time: memory, or a limit of the library.
  std::size_t most = std::numeric_limits<std::size_t>::max();
  // Why more pairs than the exact ones may be reported; empty: it reports exactly these.
  std::string superset;
  // It finds no pairs of boxes that have both not moved.
  bool leaves_out_rest = false;
  // Why it must not be shown these boxes, which would end the program; empty if it may.
  std::function<std::string(const Boxes& boxes)> refuses = [](const Boxes&) { return ""; };
  // Empty where it is not to be had on this machine.
  std::function<std::unique_ptr<Peer>(int threads)> create;
};

// All that were built in: each file in peers/ adds its own before main().
std::vector<PeerKind>& peerKinds();

struct AddPeers {
  explicit AddPeers(void (*add)(std::vector<PeerKind>& kinds)) { add(peerKinds()); }
};

}  // namespace bench
