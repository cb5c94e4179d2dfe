// The set of pairs of a library that tells only which began and which ended, kept until it has been
// looked at once: what that costs is no part of a frame.
#pragma once

#include <algorithm>
#include <set>
#include <utility>

#include "../peer.h"

namespace bench {

class KnownPairs {
 public:
  // `numbers` gives the two boxes of an event, as a pair.
  template <class Event, class Numbers>
  void follow(const Event* begun, std::size_t begun_count, const Event* ended,
              std::size_t ended_count, Numbers numbers) {
    count_ += begun_count - ended_count;
    if (!is_kept_) return;
    for (std::size_t i = 0; i < ended_count; ++i) pairs_.erase(ascending(numbers(ended[i])));
    for (std::size_t i = 0; i < begun_count; ++i) pairs_.insert(ascending(numbers(begun[i])));
  }

  std::size_t count() const { return count_; }
  void tellAll(const PairVisitor& visitor) {
    for (const auto& [first, second] : pairs_) visitor(first, second);
    is_kept_ = false;
    pairs_.clear();
  }

 private:
  using Pair = std::pair<std::size_t, std::size_t>;
  static Pair ascending(const Pair& pair) { return std::minmax(pair.first, pair.second); }

  bool is_kept_ = true;
  std::size_t count_ = 0;
  std::set<Pair> pairs_;
};

}  // namespace bench
