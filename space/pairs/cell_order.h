// The boxes cut into cells: sixteen or fewer that are near each other and of like size.
#pragma once

#include <cstdint>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/parallel.h"
#include "space/pairs/box_classes.h"
#include "space/pairs/cell_trees.h"
#include "space/pairs/quantizer.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

// Boxes are divided into classes (BoxClasses). Within a class they are sorted along a space-filling
// curve whose steps follow the class's mean extents, and the curve is cut where its digits change
// until no piece has more than sixteen boxes: each piece is what lies in one block of space. Where
// the curve is too coarse for a cluster, that is halved along its longest axis. Cells thus hold
// like numbers of boxes whatever the distribution, and no length has to be chosen by anyone.
//
// The cells are a means only: they decide how long finding the pairs takes, never which are found.
template <class Real>
class CellOrder {
 public:
  // Orders all boxes of `boxes` that are not NaN. What `workspace` holds is lost; it is of no use
  // here afterwards.
  void build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);

  CellBoxes boxesOfCells() const { return {order_.data(), starts_.data()}; }
  // Small boxes come first, unbounded ones last.
  CellClasses classes() const { return {classes_.data(), classes_.size()}; }
  std::size_t bytes() const {
    return bytesOf(box_classes_, quantizers_, positions_, bucket_ends_, pieces_, piece_starts_,
                   order_, starts_);
  }

 private:
  // Records [begin, end), alike in all digits of their keys above the lowest `digits`. Those may be
  // in any order.
  struct Piece {
    std::size_t begin, end;
    int digits;
  };
  struct Cutter;

  void layCurves(int threads);
  void assignKeys(const BoxSet& boxes, int threads);
  void dealIntoBuckets(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);
  void planPieces(const BoxSet& boxes, const Piece& piece, int sorted_digits, std::size_t most,
                  int threads);
  void cutPieces(const BoxSet& boxes, int threads);

  BoxClasses<Real> box_classes_;
  std::vector<Quantizer<Real>> quantizers_;  // one a class
  // The classes' keys follow each other; a bucket is what a key's upper digits name.
  std::vector<std::uint32_t> first_keys_;
  int bucket_shift_ = 0;
  std::size_t buckets_ = 0;
  Buffer<std::uint32_t> positions_;  // of the buckets, for each part of the slots
  Buffer<std::uint32_t> bucket_ends_;
  std::uint64_t *records_ = nullptr, *scratch_ = nullptr;  // key within its class, above slot
  std::size_t count_ = 0;                                  // of records
  std::vector<Piece> pieces_;                              // in order
  std::vector<Buffer<std::uint32_t>> piece_starts_;
  std::vector<CellClass> classes_;
  Buffer<std::uint32_t> order_;  // until the boxes are dealt into buckets: the keys, by slot
  Buffer<std::uint32_t> starts_;
};

}  // namespace ode_parallel_sap
