// The set of pairs of a library that tells only which began and which ended, kept until it has been
// looked at once; what that costs is no part of a frame.
#pragma once

#include <algorithm>
#include <set>
#include <utility>

#include "../peer.h"

namespace bench {

class KnownPairs {
 public:
  void begin(std::size_t a, std::size_t b) {
    if (is_kept_) pairs_.insert(std::minmax(a, b));
  }
  void end(std::size_t a, std::size_t b) {
    if (is_kept_) pairs_.erase(std::minmax(a, b));
  }
  bool isKept() const { return is_kept_; }

  void tellAll(const PairVisitor& visitor) {
    for (const auto& [first, second] : pairs_) visitor(first, second);
    is_kept_ = false;
    pairs_.clear();
  }

 private:
  bool is_kept_ = true;
  std::set<std::pair<std::size_t, std::size_t>> pairs_;
};

}  // namespace bench
