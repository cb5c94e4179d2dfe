#include "cell_order.h"

#include <algorithm>

#include "radix_sort.h"
#include "simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// Up to this length a crowd with equal keys is halved along its widest axis, beyond it another
// curve is laid.
constexpr std::size_t longest_halved = 512;
// Each round divides a crowd by its own range: this many only if the boxes differ by next to
// nothing.
constexpr int most_rounds = 16;

std::uint32_t slotOf(std::uint64_t record) {
  return static_cast<std::uint32_t>(record);
}
// Digits for a number of boxes: about two boxes a key when they are spread evenly.
int digitsFor(std::size_t boxes) {
  int digits = 0;
  while (digits < Quantizer<float>::max_bits && (boxes >> digits) > 2) ++digits;
  return digits;
}

}  // namespace

template <class Real>
struct CellOrder<Real>::Cutter {
  const BasicBox<Real>* boxes;
  std::uint64_t *records, *scratch;

  ClassSummary<Real> summarise(std::size_t begin, std::size_t end) const {
    ClassSummary<Real> summary;
    summary.clear();
    for (std::size_t i = begin; i < end; ++i) summary.add(boxes[slotOf(records[i])]);
    return summary;
  }

  // Sorts records that their keys do not tell apart along a curve of their own. Returns its digits;
  // 0 if all centres are the same.
  int sortAnew(std::size_t begin, std::size_t end, int threads) {
    const ClassSummary<Real> summary = summarise(begin, end);
    bool spread = false;
    for (int axis = 0; axis < 3; ++axis) spread = spread || summary.high[axis] > summary.low[axis];
    if (!spread) return 0;
    const int digits = digitsFor(summary.count);
    const Quantizer<Real> quantizer(summary, digits);
    runTeam(threads, [&](int thread, int team) {
      const Range range = partOf(end - begin, thread, team);
      for (std::size_t i = begin + range.begin; i < begin + range.end; ++i) {
        const std::uint32_t slot = slotOf(records[i]);
        records[i] = std::uint64_t{quantizer.keyOf(boxes[slot])} << 32 | slot;
      }
    });
    radixSort(records + begin, scratch + begin, end - begin, 32, digits, threads);
    return digits;
  }

  // The first record of a piece with the top one of its digits set.
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

  void cut(const Piece& piece, int round, Buffer<std::uint32_t>& starts) {
    const std::size_t count = piece.end - piece.begin;
    if (count == 0) return;
    if (count <= group_size) {
      starts.push_back(static_cast<std::uint32_t>(piece.begin));
    } else if (piece.digits > 0) {
      const std::size_t middle = cutOf(piece);
      cut({piece.begin, middle, piece.digits - 1}, round, starts);
      cut({middle, piece.end, piece.digits - 1}, round, starts);
    } else if (count <= longest_halved) {
      halve(piece.begin, piece.end, starts);
    } else {
      const int digits = round < most_rounds ? sortAnew(piece.begin, piece.end, 1) : 0;
      if (digits)
        cut({piece.begin, piece.end, digits}, round + 1, starts);
      else
        cutEvenly(piece.begin, piece.end, starts);
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

// Sorts all records by class, then by key.
template <class Real>
void CellOrder<Real>::sortByKey(const BoxSet& boxes, int threads) {
  quantizers_.clear();
  class_begins_.assign(1, 0);
  std::vector<std::uint64_t> first_keys;
  std::uint64_t keys = 0;
  for (int i = 0; i < size_classes_.count(); ++i) {
    const ClassSummary<Real>& summary = size_classes_.summary(i);
    const int digits = size_classes_.isUnbounded(i) ? 0 : digitsFor(summary.count);
    quantizers_.emplace_back(summary, digits);
    first_keys.push_back(keys);
    keys += std::uint64_t{1} << digits;
    class_begins_.push_back(class_begins_.back() + summary.count);
  }
  const std::size_t count = class_begins_.back();
  records_.resizeDiscarding(count);
  scratch_.resizeDiscarding(count);
  order_.resizeDiscarding(count);
  if (count == 0) return;

  const BasicBox<Real>* const box = boxesOf<Real>(boxes);
  // Each part's records go behind those of the parts before it.
  const int parts = threads;
  part_begins_.assign(parts + 1, 0);
  runTeam(parts, [&](int thread, int team) {
    for (int part = thread; part < parts; part += team) {
      const Range range = partOf(boxes.size, part, parts);
      std::size_t active = 0;
      for (std::size_t slot = range.begin; slot < range.end; ++slot) active += isActive(box[slot]);
      part_begins_[part + 1] = active;
    }
  });
  for (int part = 0; part < parts; ++part) part_begins_[part + 1] += part_begins_[part];
  runTeam(parts, [&](int thread, int team) {
    for (int part = thread; part < parts; part += team) {
      const Range range = partOf(boxes.size, part, parts);
      std::uint64_t* out = records_.data() + part_begins_[part];
      for (std::size_t slot = range.begin; slot < range.end; ++slot) {
        if (!isActive(box[slot])) continue;
        const int of = size_classes_.of(box[slot]);
        *out++ = (first_keys[of] + quantizers_[of].keyOf(box[slot])) << 32 | slot;
      }
    }
  });
  int key_bits = 0;
  while ((keys - 1) >> key_bits) ++key_bits;
  radixSort(records_.data(), scratch_.data(), count, 32, key_bits, threads);

  // A class's own keys begin at 0 again, so that their digits are those of the curve.
  if (size_classes_.count() > 1)
    for (int i = 1; i < size_classes_.count(); ++i)
      runTeam(threads, [&](int thread, int team) {
        const Range range = partOf(class_begins_[i + 1] - class_begins_[i], thread, team);
        for (std::size_t k = range.begin; k < range.end; ++k)
          records_[class_begins_[i] + k] -= first_keys[i] << 32;
      });
}

// Divides a piece into pieces of `most` boxes for single threads. Crowds that are longer even at
// the last digit are sorted again by all threads.
template <class Real>
void CellOrder<Real>::planPieces(const BoxSet& boxes, const Piece& piece, std::size_t most,
                                 int threads, int round) {
  if (piece.begin == piece.end) return;
  Cutter cutter = {boxesOf<Real>(boxes), records_.data(), scratch_.data()};
  if (piece.end - piece.begin <= most) {
    pieces_.push_back(piece);
  } else if (piece.digits > 0) {
    const std::size_t middle = cutter.cutOf(piece);
    planPieces(boxes, {piece.begin, middle, piece.digits - 1}, most, threads, round);
    planPieces(boxes, {middle, piece.end, piece.digits - 1}, most, threads, round);
  } else {
    const int digits = round < most_rounds ? cutter.sortAnew(piece.begin, piece.end, threads) : 0;
    if (digits)
      planPieces(boxes, {piece.begin, piece.end, digits}, most, threads, round + 1);
    else
      pieces_.push_back(piece);
  }
}

template <class Real>
void CellOrder<Real>::cutPieces(const BoxSet& boxes, int threads) {
  if (piece_starts_.size() < pieces_.size()) piece_starts_.resize(pieces_.size());
  ChunkQueue queue(pieces_.size(), 1);
  runTeam(threads, [&](int, int) {
    Cutter cutter = {boxesOf<Real>(boxes), records_.data(), scratch_.data()};
    Range range;
    while (queue.next(range)) {
      const Piece& piece = pieces_[range.begin];
      Buffer<std::uint32_t>& starts = piece_starts_[range.begin];
      starts.resizeDiscarding(0);
      cutter.cut(piece, 0, starts);
      for (std::size_t i = piece.begin; i < piece.end; ++i) order_[i] = slotOf(records_[i]);
    }
  });
}

template <class Real>
void CellOrder<Real>::build(const BoxSet& boxes, int threads) {
  size_classes_.choose(boxes, threads);
  sortByKey(boxes, threads);

  pieces_.clear();
  classes_.clear();
  std::vector<std::size_t> first_pieces;
  constexpr std::size_t pieces_a_thread = 16;
  const std::size_t most = std::max(records_.size() / (pieces_a_thread * threads), longest_halved);
  for (int i = 0; i < size_classes_.count(); ++i) {
    first_pieces.push_back(pieces_.size());
    planPieces(boxes, {class_begins_[i], class_begins_[i + 1], quantizers_[i].digits()}, most,
               threads, 0);
  }
  first_pieces.push_back(pieces_.size());
  cutPieces(boxes, threads);

  starts_.resizeDiscarding(0);
  for (int i = 0; i < size_classes_.count(); ++i) {
    const std::size_t first_cell = starts_.size();
    for (std::size_t piece = first_pieces[i]; piece < first_pieces[i + 1]; ++piece) {
      const Buffer<std::uint32_t>& from = piece_starts_[piece];
      starts_.resize(starts_.size() + from.size());
      std::copy(from.begin(), from.end(), starts_.end() - from.size());
    }
    classes_.push_back({first_cell, starts_.size()});
  }
  starts_.push_back(static_cast<std::uint32_t>(records_.size()));
}

template <class Real>
std::size_t CellOrder<Real>::bytes() const {
  std::size_t bytes = records_.bytes() + scratch_.bytes() + order_.bytes() + starts_.bytes() +
                      size_classes_.bytes() + quantizers_.capacity() * sizeof(Quantizer<Real>) +
                      pieces_.capacity() * sizeof(Piece);
  for (const Buffer<std::uint32_t>& starts : piece_starts_) bytes += starts.bytes();
  return bytes;
}

template class CellOrder<float>;
template class CellOrder<double>;

}  // namespace ode_parallel_sap
