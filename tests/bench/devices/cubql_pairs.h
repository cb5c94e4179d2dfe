// The pairs of boxes by cuBQL's trees on a device, from host memory to host memory. No type of
// cuBQL's in here.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "space/base/pair_list.h"

namespace bench {

struct CubqlSetting {
  std::string builder;  // one of cubqlBuilders()
  int leaf = 1;         // boxes up to which the builder makes a leaf
  int pieces = 1;       // of the boxes: the pairs of one leave while those of the next are found
};

const std::vector<std::string>& cubqlBuilders();

// Milliseconds on the device.
struct CubqlTimes {
  float upload = 0;
  float build = 0;     // the tree, with the host's steps in between
  float query = 0;     // until all pairs are on the device
  float download = 0;  // from there to the last pair in host memory
};

// Boxes and pairs are in locked pages. Throws DeviceFailure; failures of cuBQL's own calls end the
// program.
class CubqlPairs {
 public:
  // A copy of the boxes, and room for so many pairs.
  CubqlPairs(const ode_parallel_sap::BoxSet& boxes, std::size_t room);
  ~CubqlPairs();
  CubqlPairs(const CubqlPairs&) = delete;
  CubqlPairs& operator=(const CubqlPairs&) = delete;

  // Uploads, builds a tree, finds the pairs and fetches them: milliseconds by the clock. The tree
  // is given back after that.
  double find(const CubqlSetting& setting);
  // Of the last find(), in no order: the earlier slot above the later.
  const ode_parallel_sap::Pair* pairs() const;
  // How many were found; those beyond the room are lost.
  std::size_t found() const;
  CubqlTimes times() const;

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace bench
