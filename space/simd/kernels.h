// The inner loops, compiled once for each instruction set and chosen at run time.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap {

template <class Real>
struct BasicBox;

constexpr int group_size = 16;  // fixed: lanes of the widest vectors
template <class Count>
constexpr Count groupsFor(Count count) {
  return (count + group_size - 1) / group_size;
}

// Sixteen boxes side by side: the boxes of a cell, or the bounds of sixteen cells or nodes. Unused
// places hold NaN, which overlaps nothing, and one of the slots.
template <class Real>
struct alignas(64) Group {
  Real lower[3][group_size];
  Real upper[3][group_size];
  std::uint32_t slot[group_size];  // of boxes only
};

// What goes with the sixteen boxes of a cell.
struct alignas(64) GroupFilter {
  std::uint32_t category[group_size];
  std::uint32_t collide[group_size];
  std::uint64_t body[group_size];
};

// A tree over cells that are consecutive in memory: levels[0] are the cells themselves, each group
// of a higher level holds the bounds of sixteen groups of the level below, and the last level is a
// single group. Cells of several trees may lie one after the other, numbered through all of them.
template <class Real>
struct TreeView {
  static constexpr int max_levels = 8;  // fixed: of 2^32 cells
  const Group<Real>* levels[max_levels];
  std::uint32_t groups[max_levels];
  int depth;                   // levels in use; 0: no boxes
  const GroupFilter* filters;  // null: no pair is filtered
  std::uint32_t first_cell;    // its number; 0 where there is one tree only
};

// Cells of a tree whose boxes are to meet each other, those of later cells, and those of later
// trees. The cells of all trees lie one after the other in memory, in their order.
template <class Real>
struct PairSearch {
  const TreeView<Real>* trees;
  std::size_t tree_count;
  std::size_t own;         // tree
  std::size_t begin, end;  // cells of it
};

// Where a thread puts pairs: those of 2^chunk_bits earlier slots go to blocks of their own. A pair
// is twice the later slot below twice the earlier one, 1 more where floats cannot decide.
constexpr std::size_t row_block_bytes = 512;  // fixed: to which blocks are aligned
struct RowBlocks {
  int chunk_bits = 0;
  // By chunk, where its next pair goes. A multiple of row_block_bytes: into a new block.
  std::uint64_t** next = nullptr;
  // Returns where its first pair goes.
  virtual std::uint64_t* addBlock(std::size_t chunk) = 0;

 protected:
  ~RowBlocks() = default;
};

// The pairs of a chunk: for each slot from `first` on a row of words, in no order, which is lost.
// Sixteen more words may be read. `room` is that of the longest row and sixteen words.
struct RowChunk {
  std::uint32_t* words;
  const std::uint32_t* ends;  // of rows
  std::size_t first, slots;
  std::uint32_t* room;
};

// Cell i has the boxes order[starts[i]] to order[starts[i + 1] - 1], sixteen at most.
struct CellBoxes {
  const std::uint32_t* order;
  const std::uint32_t* starts;
};

// Where a box is, and whose it is.
struct alignas(16) Centre {
  float at[3];  // no NaN
  std::uint32_t slot;
};
// Numbers that cutIntoCells() needs room for.
constexpr std::size_t roomToCut(std::size_t count) {
  return 8 * (count + 3 * group_size);
}

// The line origin + t * direction, t >= 0, and by how much boxes are widened before they meet it:
// `rounding` times the distance from the origin to their farthest bound on any axis, and `slack`.
template <class Real>
struct RayQuery {
  Real origin[3];
  Real inverse[3];  // of the direction; finite
  Real rounding, slack;
};

// Each for boxes of floats and of doubles.
template <class Real>
struct Kernels {
  // Fills cells[i] for i in [begin, end).
  void (*packCells)(const BasicBox<Real>* boxes, const CellBoxes& of, std::size_t begin,
                    std::size_t end, Group<Real>* cells);
  // Group i of `parents` gets the bounds of groups 16 i to 16 i + 15 of `children`, for i in
  // [begin, end); places at and beyond `count` children stay empty.
  void (*packBounds)(const Group<Real>* children, std::size_t count, std::size_t begin,
                     std::size_t end, Group<Real>* parents);
  // Finds the pairs of some cells, each once.
  void (*findPairs)(const PairSearch<Real>& search, RowBlocks& blocks);
  // Brute force: writes the places, ascending through all cells, of later boxes that overlap that
  // in a place. Returns their number; up to sixteen numbers beyond are written.
  std::size_t (*testLater)(const Group<Real>* cells, std::size_t count, std::size_t place,
                           std::uint32_t* found);
  // Writes twice the slots of all boxes of `tree`, which is not empty, that overlap box 0 of `box`,
  // whose slot is -1, in no order, 1 more where floats cannot decide. Returns their number; up to
  // sixteen words beyond are written.
  std::size_t (*findInTree)(const TreeView<Real>& tree, const Group<Real>& box,
                            std::uint32_t* found);
  // The same for cells without a tree.
  std::size_t (*findInCells)(const Group<Real>* cells, std::size_t count, const Group<Real>& box,
                             std::uint32_t* found);
  // Which of sixteen boxes the ray meets for a t from 0 to `limit`, and in entry[i], aligned like
  // `boxes`, the least such t. Rounding may make it meet a box too many, but none too few, and a t
  // too large by 2^-20 of it at most.
  unsigned (*meetRay)(const Group<Real>& boxes, const RayQuery<Real>& ray, Real limit, Real* entry);
};

// All that one instruction set has.
struct KernelSet {
  const char* name;
  Kernels<float> narrow;
  Kernels<double> wide;
  // Bit i, i < count <= 64: box i is active and, less `move` bound by bound, not within room[i].
  std::uint64_t (*boxesOutside)(const BasicBox<float>* boxes, const BasicBox<float>& move,
                                const BasicBox<float>* room, std::size_t count);
  // Writes to `end` those of `kept`, without the borderline bit and in their order, whose boxes
  // overlap, with that bit where floats cannot decide, and moves it behind them; there is room for
  // all. Returns whether one may be borderline; not if floats are `exact`.
  bool (*keptPairs)(const BasicBox<float>* boxes, const std::uint64_t* kept, std::size_t count,
                    bool exact, std::uint64_t*& end);
  // Halves centres along the axis on which they lie farthest apart until sixteen are left. Writes
  // their slots, cell by cell, to `order` from place `first` on, and these places to `starts`: each
  // cell but the last one has sixteen, in the order of `centres`. `room` is aligned.
  void (*cutIntoCells)(const Centre* centres, std::size_t count, float* room, std::uint32_t first,
                       std::uint32_t* order, std::uint32_t* starts);
  // Writes the pairs of a chunk as they are to be reported; there is room for no more. Returns
  // whether one may be borderline; not if floats are `exact`.
  bool (*writeRows)(const RowChunk& rows, bool exact, std::uint64_t* pairs,
                    std::uint64_t* pairs_end);
};

extern const KernelSet kernels_portable;
extern const KernelSet kernels_sse2, kernels_avx2, kernels_avx512;  // on x86-64 only
extern const KernelSet kernels_neon;                                // on 64-bit ARM only

// The set in use: the best one for this processor unless another was chosen.
const KernelSet& kernelSet();

// For tests and comparisons. A frame under way may finish with another set: each finds the same.
void chooseKernelSet(const KernelSet& set);

template <class Real>
const Kernels<Real>& kernels() {
  if constexpr (sizeof(Real) == sizeof(float))
    return kernelSet().narrow;
  else
    return kernelSet().wide;
}

// Every set this processor can run, best first; null ends the list.
const KernelSet* const* allKernelSets();

// The one of them with this name, or null.
const KernelSet* kernelSetNamed(const char* name);

}  // namespace ode_parallel_sap
