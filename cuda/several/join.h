// From the lists of several devices to the pairs of the scene, in order. Plain host code.
#ifndef ODE_PARALLEL_SAP_CUDA_JOIN_H
#define ODE_PARALLEL_SAP_CUDA_JOIN_H

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/one/scene_plan.h"
#include "cuda/several/partition.h"
#include "cuda/several/tuning.h"
#include "space/data/buffer.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// One device's sorted lists as they travel (scene_plan.h), by the slots of the whole scene.
struct ShareLists {
  const std::uint32_t* segments = nullptr;
  const unsigned long long* begins = nullptr;  // words before each block of slots, and of all
  const std::uint32_t* has_list = nullptr;     // bit i: slot i has a list
};

// Blocks [begin, end) of list_block slots, whose pairs begin at place `pairs` of the result. They
// can be joined once `needed` words of each share have come.
struct Slice {
  std::size_t begin, end, pairs;
  unsigned long long needed[most_shares];
  unsigned long long most_needed;
};

// Cuts `blocks` blocks into slices of about the same number of pairs, in the order in which they
// can be joined if words come equally fast from all devices.
std::vector<Slice> slicesOf(const ShareLists* shares, int count, std::size_t blocks);

// Where joined pairs go: gathered in the nearest cache, then on to the result, past the caches if
// the result is too large for them.
class PairStage {
 public:
  static constexpr std::size_t line = 64 / sizeof(Pair);
  // fixed: pairs that room is made for at once: with a line more they are 16 kB, and stay in the
  // nearest cache.
  static constexpr std::size_t most = 2040;
  // fixed: and that may be written behind them, two vectors.
  static constexpr std::size_t beyond = 8;

  void begin(Pair* to, bool past_caches);
  // Where to write the next `count` pairs; add() when they are written.
  Pair* room(std::size_t count);
  void add(std::size_t count) { count_ += count; }
  void end();

 private:
  static constexpr std::size_t capacity = most + line;

  void pass();

  Buffer<Pair> pairs_;
  std::size_t count_ = 0;
  Pair* to_ = nullptr;
  bool past_caches_ = false;
};

// What is joined, and to where.
struct Joining {
  const ShareLists* shares;
  int count;  // of shares
  std::size_t slots;
  bool exact;        // no pair is borderline
  bool past_caches;  // is how pairs are written
  Pair* to;          // the first of all
};

// Joins slices. One for each thread.
class Joiner {
 public:
  // Writes the slice's pairs to their places. Segments with borderline pairs are added to
  // `borderline`.
  void join(const Joining& joining, const Slice& slice, std::vector<PairList::Segment>& borderline);

 private:
  static constexpr int group = 64;  // fixed: slots looked at together, a bit of a word each

  struct List {
    const std::uint32_t* words;
    std::size_t count;
  };
  // What 64 words in a row are like.
  struct Summary {
    std::uint64_t heads;  // bit i: word i begins a list
    bool borderline;      // whether a pair of theirs is
  };
  // One share's words of a slice, and how far they are taken.
  struct Cursor {
    const std::uint32_t* words;
    const Summary* summaries;
    std::uint64_t left;  // of the heads that hold the next list's end
    std::size_t base;    // the place of their first word
    std::size_t begin;   // that of the next list
  };
  // A list of a slot that is in several shares.
  struct Another {
    int bit;
    List list;
  };

  void gather(const Joining& joining, const Slice& slice);
  std::uint64_t takeLists(const Joining& joining, std::size_t first, std::size_t& pairs);
  void put(std::size_t first, std::uint64_t any, std::size_t pairs);
  List merged(int bit);
  bool hasBorderline(const Joining& joining, const Slice& slice, std::size_t block) const;

  Buffer<std::uint32_t> words_;  // the slice's, share after share
  Buffer<Summary> summaries_;
  Cursor cursors_[most_shares] = {};
  List lists_[group] = {};  // of the group's slots
  std::vector<Another> others_;
  Buffer<std::uint32_t> merged_, more_;
  PairStage stage_;
};

}  // namespace ode_parallel_sap

#endif
