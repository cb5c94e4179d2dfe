#include "space/pairs/cell_order.h"

#include <algorithm>
#include <utility>

#include "space/base/tuning.h"
#include "space/pairs/radix_sort.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

Region keying("cell order: keys");
Region dealing("cell order: buckets"), cutting("cell order: pieces");

constexpr std::uint32_t no_key = ~std::uint32_t{0};

std::uint32_t slotOf(std::uint64_t record) {
  return static_cast<std::uint32_t>(record);
}
// Digits for a number of boxes: about two boxes a key where the boxes are spread evenly, and five
// digits more, which separate the boxes of a place that is thirty times as clustered.
int digitsFor(std::size_t boxes) {
  int digits = 0;
  while (digits < Quantizer<float>::max_bits && (boxes << digits_for_clusters >> digits) > 2)
    ++digits;
  return digits;
}

}  // namespace

template <class Real>
struct CellOrder<Real>::Cutter {
  const BasicBox<Real>* boxes;
  std::uint64_t *records, *scratch;

  ClassSummary<Real> summarise(std::size_t begin, std::size_t end) const {
    ClassSummary<Real> summary;
    for (std::size_t i = begin; i < end; ++i) summary.add(boxes[slotOf(records[i])]);
    return summary;
  }

  // Sorts a piece by its digits, on one thread.
  void sortPiece(const Piece& piece) {
    const std::size_t count = piece.end - piece.begin;
    if (count > group_size)
      radixSort(records + piece.begin, scratch + piece.begin, count, 32, piece.digits, 1);
  }

  // The first record of a sorted piece with the top one of its digits set.
  std::size_t cutOf(const Piece& piece) const {
    const std::uint64_t bit = std::uint64_t{1} << (32 + piece.digits - 1);
    std::size_t low = piece.begin, high = piece.end;
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (records[middle] & bit)
        high = middle;
      else
        low = middle + 1;
    }
    return low;
  }

  void cut(const Piece& piece, Buffer<std::uint32_t>& starts) {
    const std::size_t count = piece.end - piece.begin;
    if (count == 0) return;
    if (count <= group_size) {
      starts.push_back(static_cast<std::uint32_t>(piece.begin));
    } else if (piece.digits > 0) {
      const std::size_t middle = cutOf(piece);
      cut({piece.begin, middle, piece.digits - 1}, starts);
      cut({middle, piece.end, piece.digits - 1}, starts);
    } else {
      halve(piece.begin, piece.end, starts);
    }
  }

  void cutEvenly(std::size_t begin, std::size_t end, Buffer<std::uint32_t>& starts) {
    for (; begin < end; begin += group_size) starts.push_back(static_cast<std::uint32_t>(begin));
  }

  void halve(std::size_t begin, std::size_t end, Buffer<std::uint32_t>& starts) {
    if (end - begin <= group_size) {
      starts.push_back(static_cast<std::uint32_t>(begin));
      return;
    }
    const ClassSummary<Real> summary = summarise(begin, end);
    int axis = 0;
    for (int other = 1; other < 3; ++other)
      if (summary.high[other] - summary.low[other] > summary.high[axis] - summary.low[axis])
        axis = other;
    if (!(summary.high[axis] > summary.low[axis])) {
      cutEvenly(begin, end, starts);
      return;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    const auto before = [this, axis](std::uint64_t a, std::uint64_t b) {
      const Real ca = centreOf(boxes[slotOf(a)], axis), cb = centreOf(boxes[slotOf(b)], axis);
      return ca != cb ? ca < cb : slotOf(a) < slotOf(b);
    };
    std::nth_element(records + begin, records + middle, records + end, before);
    halve(begin, middle, starts);
    halve(middle, end, starts);
  }
};

// Gives each class its curve, and its keys after those of the class before.
template <class Real>
void CellOrder<Real>::layCurves(int threads) {
  quantizers_.clear();
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < box_classes_.count(); ++i) {
    const ClassSummary<Real>& summary = box_classes_.summary(i);
    quantizers_.emplace_back(summary, box_classes_.isUnbounded(i) ? 0 : digitsFor(summary.count));
    all += std::uint64_t{1} << quantizers_.back().digits();
  }
  for (bucket_shift_ = 0; all >> bucket_shift_ > std::uint64_t{1} << most_digits;) ++bucket_shift_;
  // No bucket is shared by two classes.
  first_keys_.clear();
  buckets_ = 0;
  for (const Quantizer<Real>& quantizer : quantizers_) {
    first_keys_.push_back(static_cast<std::uint32_t>(buckets_ << bucket_shift_));
    const std::uint64_t keys = std::uint64_t{1} << quantizer.digits();
    buckets_ += (keys + (std::uint64_t{1} << bucket_shift_) - 1) >> bucket_shift_;
  }
  first_keys_.push_back(static_cast<std::uint32_t>(buckets_ << bucket_shift_));
  positions_.resizeDiscarding(buckets_ * threads);
}

// Gives every box a key: its class's first one plus its place on the class's curve.
template <class Real>
void CellOrder<Real>::assignKeys(const BoxSet& boxes, int threads) {
  order_.resizeDiscarding(boxes.size);
  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  runTeam(keying, threads, [&](int part, int parts) {
    std::uint32_t* const counts = positions_.data() + buckets_ * part;
    std::fill(counts, counts + buckets_, 0);
    const Range range = ownPart(boxes.size, part, parts);
    for (std::size_t slot = range.begin; slot < range.end; ++slot) {
      if (!isActive(box[slot])) {
        order_[slot] = no_key;
        continue;
      }
      const std::size_t of = box_classes_.of(box[slot]);
      const std::uint32_t key = first_keys_[of] + quantizers_[of].keyOf(box[slot]);
      order_[slot] = key;
      ++counts[key >> bucket_shift_];
    }
  });
}

// Puts the records of each bucket in a row. Within a bucket they keep the order of their slots.
template <class Real>
void CellOrder<Real>::dealIntoBuckets(const BoxSet& boxes, int threads,
                                      Buffer<std::uint64_t>& workspace) {
  bucket_ends_.resizeDiscarding(buckets_);
  std::uint32_t position = 0;
  for (std::size_t bucket = 0; bucket < buckets_; ++bucket) {
    for (int part = 0; part < threads; ++part)
      position += std::exchange(positions_[buckets_ * part + bucket], position);
    bucket_ends_[bucket] = position;
  }
  count_ = position;
  workspace.resizeDiscarding(2 * count_);
  records_ = workspace.data();
  scratch_ = records_ + count_;
  const std::size_t classes = box_classes_.count();
  runTeam(dealing, threads, [&](int part, int parts) {
    std::uint32_t* const next = positions_.data() + buckets_ * part;
    const Range range = ownPart(boxes.size, part, parts);
    for (std::size_t slot = range.begin; slot < range.end; ++slot) {
      const std::uint32_t key = order_[slot];
      if (key == no_key) continue;
      std::uint32_t first_key = 0;
      for (std::size_t of = 1; of < classes && first_keys_[of] <= key; ++of)
        first_key = first_keys_[of];
      records_[next[key >> bucket_shift_]++] = std::uint64_t{key - first_key} << 32 | slot;
    }
  });
}

// Divides a piece into pieces of `most` boxes for single threads, as far as the digits go that are
// sorted already. Clusters that are longer than that are sorted by all threads.
template <class Real>
void CellOrder<Real>::planPieces(const BoxSet& boxes, const Piece& piece, int sorted_digits,
                                 std::size_t most, int threads) {
  if (piece.begin == piece.end) return;
  Cutter cutter = {boxesOf<Real>(boxes), records_, scratch_};
  const std::size_t count = piece.end - piece.begin;
  if (count <= most) {
    pieces_.push_back(piece);
  } else if (sorted_digits > 0) {
    const std::size_t middle = cutter.cutOf(piece);
    for (const Piece& half :
         {Piece{piece.begin, middle, piece.digits - 1}, Piece{middle, piece.end, piece.digits - 1}})
      planPieces(boxes, half, sorted_digits - 1, most, threads);
  } else if (piece.digits > 0) {
    radixSort(records_ + piece.begin, scratch_ + piece.begin, count, 32, piece.digits, threads);
    planPieces(boxes, piece, piece.digits, most, threads);
  } else {
    pieces_.push_back(piece);
  }
}

template <class Real>
void CellOrder<Real>::cutPieces(const BoxSet& boxes, int threads) {
  if (piece_starts_.size() < pieces_.size()) piece_starts_.resize(pieces_.size());
  runChunks(cutting, threads, pieces_.size(), 1, [&](const Range& range, int) {
    Cutter cutter = {boxesOf<Real>(boxes), records_, scratch_};
    const Piece& piece = pieces_[range.begin];
    Buffer<std::uint32_t>& starts = piece_starts_[range.begin];
    starts.resizeDiscarding(0);
    cutter.sortPiece(piece);
    cutter.cut(piece, starts);
    for (std::size_t i = piece.begin; i < piece.end; ++i) order_[i] = slotOf(records_[i]);
  });
}

template <class Real>
void CellOrder<Real>::build(const BoxSet& boxes, int threads, Buffer<std::uint64_t>& workspace) {
  box_classes_.choose(boxes, threads);
  layCurves(threads);
  assignKeys(boxes, threads);
  dealIntoBuckets(boxes, threads, workspace);

  pieces_.clear();
  classes_.clear();
  std::vector<std::size_t> first_pieces;
  const std::size_t least =
      std::max<std::size_t>(chunkOf(count_, least_piece_boxes, threads), group_size);
  const std::size_t most =
      std::max(std::min(count_ / (tasks_a_thread * threads), most_piece_boxes), least);
  for (std::size_t i = 0; i < box_classes_.count(); ++i) {
    first_pieces.push_back(pieces_.size());
    const std::size_t first_bucket = first_keys_[i] >> bucket_shift_;
    const std::size_t last_bucket = (first_keys_[i + 1] >> bucket_shift_) - 1;
    const int digits = quantizers_[i].digits();
    planPieces(
        boxes,
        {first_bucket ? bucket_ends_[first_bucket - 1] : 0, bucket_ends_[last_bucket], digits},
        std::max(0, digits - bucket_shift_), most, threads);
  }
  first_pieces.push_back(pieces_.size());
  cutPieces(boxes, threads);

  starts_.resizeDiscarding(0);
  for (std::size_t i = 0; i < box_classes_.count(); ++i) {
    const std::size_t first_cell = starts_.size();
    for (std::size_t piece = first_pieces[i]; piece < first_pieces[i + 1]; ++piece) {
      const Buffer<std::uint32_t>& from = piece_starts_[piece];
      starts_.resize(starts_.size() + from.size());
      std::copy(from.begin(), from.end(), starts_.end() - from.size());
    }
    classes_.push_back({first_cell, starts_.size()});
  }
  starts_.push_back(static_cast<std::uint32_t>(count_));
}

template class CellOrder<float>;
template class CellOrder<double>;

}  // namespace ode_parallel_sap
