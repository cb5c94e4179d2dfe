// The boxes cut into cells: sixteen or fewer that are near each other and of like size.
#ifndef ODE_PARALLEL_SAP_CELL_ORDER_H
#define ODE_PARALLEL_SAP_CELL_ORDER_H

#include <cstdint>
#include <vector>

#include "space/cells/quantizer.h"
#include "space/cells/size_classes.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

// Within a class of sizes the boxes are sorted along a space-filling curve whose steps follow the
// class's mean extents, and the curve is cut where its digits change until no piece has more than
// sixteen boxes: each piece is what lies in one block of space. Where the curve is too coarse for a
// cluster, another is laid through that cluster alone. Cells thus hold like numbers of boxes
// whatever the distribution, and no length has to be chosen by anyone.
//
// The cells are a means only: they decide how long finding the pairs takes, never which are found.
template <class Real>
class CellOrder {
 public:
  // Cells [first_cell, last_cell) hold the boxes of one class. Small sizes come first.
  struct Class {
    std::size_t first_cell, last_cell;
  };

  // Orders all boxes of `boxes` that are not NaN. What `workspace` holds is lost; it is of no use
  // here afterwards.
  void build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);

  // Cell i holds the slots order()[starts()[i]] to order()[starts()[i + 1] - 1].
  const std::uint32_t* order() const { return order_.data(); }
  const std::uint32_t* starts() const { return starts_.data(); }
  const std::vector<Class>& classes() const { return classes_; }
  // Whether a class holds the boxes that are infinite on some side.
  bool isUnbounded(std::size_t index) const {
    return size_classes_.isUnbounded(static_cast<int>(index));
  }
  std::size_t bytes() const;

 private:
  // Records [begin, end), alike in all digits of their keys above the lowest `digits`. Those may be
  // in any order.
  struct Piece {
    std::size_t begin, end;
    int digits;
  };
  struct Cutter;

  void assignKeys(const BoxSet& boxes, int threads);
  void dealIntoBuckets(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace);
  void planPieces(const BoxSet& boxes, const Piece& piece, int sorted_digits, std::size_t most,
                  int threads, int round);
  void cutPieces(const BoxSet& boxes, int threads);

  SizeClasses<Real> size_classes_;
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
  std::vector<Class> classes_;
  Buffer<std::uint32_t> order_;  // until the boxes are dealt into buckets: the keys, by slot
  Buffer<std::uint32_t> starts_;
};

}  // namespace ode_parallel_sap

#endif
