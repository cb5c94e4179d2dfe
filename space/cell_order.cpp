#include "cell_order.h"

#include <algorithm>
#include <cstring>

#include "radix_sort.h"
#include "simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// Sizes within a factor of 2^3 share a class: cells of mixed sizes are then at most as wide as
// their largest boxes, and boxes of one size rarely straddle two classes.
constexpr int class_octaves = 3;
// Below this share of all boxes a class of small boxes is not worth a tree of its own.
constexpr std::size_t least_share = 32;
// A shape (long in some axes, short in others) gets a class from this share of its size class on.
constexpr std::size_t least_shape_share = 16;
// Boxes in a row with equal keys beyond this number are ordered again among themselves.
constexpr std::size_t long_run = 2 * group_size;
// Up to this length that is done by halving along the widest axis, beyond it by a curve of its own.
constexpr std::size_t longest_halved_run = 512;

constexpr std::uint8_t no_class = 0xff;
constexpr int unbounded_octave = 255;

std::uint32_t slotOf(std::uint64_t record) {
  return static_cast<std::uint32_t>(record);
}
std::uint32_t keyOf(std::uint64_t record) {
  return static_cast<std::uint32_t>(record >> 32);
}

// Binary digits for a class: about two boxes a key when spread evenly.
int digitsFor(std::size_t boxes) {
  int digits = 0;
  while (digits < Quantizer::max_bits && (boxes >> digits) > 2) ++digits;
  return digits;
}

bool isActive(const Box& box) {
  return box.lower[0] == box.lower[0];
}

int octaveOf(float extent) {
  std::int32_t bits;
  std::memcpy(&bits, &extent, sizeof bits);
  const bool negative = bits<0, nan = (bits & 0x7fffffff)> 0x7f800000;
  return negative && !nan ? 0 : bits >> 23 & 0xff;
}

// Whether slot a goes before b when boxes are halved along `axis`.
struct BeforeOnAxis {
  const Box* boxes;
  int axis;
  bool operator()(std::uint64_t a, std::uint64_t b) const {
    const float ca = centreOf(boxes[slotOf(a)], axis), cb = centreOf(boxes[slotOf(b)], axis);
    return ca != cb ? ca < cb : slotOf(a) < slotOf(b);
  }
};

ClassSummary summarise(const Box* boxes, const std::uint64_t* records, std::size_t begin,
                       std::size_t end) {
  ClassSummary summary;
  summary.clear();
  for (std::size_t i = begin; i < end; ++i) summary.add(boxes[slotOf(records[i])]);
  return summary;
}

// Halves the records along their widest axis, at a cell boundary, until they fit in one cell.
void halve(const Box* boxes, std::uint64_t* records, std::size_t begin, std::size_t end,
           std::size_t class_begin) {
  while (end - begin > group_size) {
    const ClassSummary summary = summarise(boxes, records, begin, end);
    int axis = 0;
    for (int other = 1; other < 3; ++other)
      if (summary.high[other] - summary.low[other] > summary.high[axis] - summary.low[axis])
        axis = other;
    if (!(summary.high[axis] > summary.low[axis])) return;
    const std::size_t half = begin + (end - begin) / 2;
    std::size_t middle =
        class_begin + (half - class_begin + group_size / 2) / group_size * group_size;
    if (middle <= begin || middle >= end) middle = half;
    std::nth_element(records + begin, records + middle, records + end, BeforeOnAxis{boxes, axis});
    halve(boxes, records, begin, middle, class_begin);
    begin = middle;
  }
}

}  // namespace

// The octave of the greatest extent, and for each axis whether the extent there is far shorter.
unsigned CellOrder::binOf(const Box& box) {
  int octave[3];
  for (int axis = 0; axis < 3; ++axis) octave[axis] = octaveOf(box.upper[axis] - box.lower[axis]);
  const int greatest = std::max({octave[0], octave[1], octave[2]});
  if (greatest == unbounded_octave) return unbounded_octave * 8;
  unsigned shape = 0;
  for (int axis = 0; axis < 3; ++axis)
    shape |= unsigned{greatest - octave[axis] >= class_octaves} << axis;
  return greatest * 8 + shape;
}

// Takes the fullest window of octaves as a class, then the fullest of the rest, and so on; then
// splits classes by shape where a shape is common.
CellOrder::ClassTable CellOrder::chooseClasses(const std::array<std::uint32_t, bins>& histogram) {
  std::array<std::size_t, 256> octaves = {};
  std::size_t all = 0;
  for (int bin = 0; bin < bins; ++bin) octaves[bin / 8] += histogram[bin];
  for (int octave = 0; octave < unbounded_octave; ++octave) all += octaves[octave];

  struct Window {
    int first, last;
    std::size_t count;
  };
  std::vector<Window> windows;
  std::array<bool, 256> taken = {};
  for (std::size_t left = all; left > 0;) {
    Window best = {0, 0, 0};
    for (int first = 0; first < unbounded_octave; ++first) {
      std::size_t count = 0;
      int last = first;
      for (; last < first + class_octaves && last < unbounded_octave && !taken[last]; ++last)
        count += octaves[last];
      if (count > best.count) best = {first, last - 1, count};
    }
    for (int octave = best.first; octave <= best.last; ++octave) taken[octave] = true;
    windows.push_back(best);
    left -= best.count;
  }
  std::sort(windows.begin(), windows.end(),
            [](const Window& a, const Window& b) { return a.first < b.first; });
  // Few small boxes do no harm among larger ones. The last of too many join as well.
  constexpr std::size_t most_windows = max_classes / 2;
  for (std::size_t i = 0; i + 1 < windows.size();) {
    if (windows[i].count < all / least_share || windows.size() > most_windows) {
      windows[i + 1].first = windows[i].first;
      windows[i + 1].count += windows[i].count;
      windows.erase(windows.begin() + i);
    } else {
      ++i;
    }
  }

  ClassTable table;
  table.fill(no_class);
  class_count_ = 0;
  for (const Window& window : windows) {
    std::array<std::size_t, 8> shapes = {};
    for (int bin = window.first * 8; bin < window.last * 8 + 8; ++bin)
      shapes[bin % 8] += histogram[bin];
    const std::size_t least = std::max(window.count / least_shape_share, std::size_t{64});
    const int classes_left =
        max_classes - 1 - class_count_ - static_cast<int>(&windows.back() - &window);
    int shared = -1;  // the class of all shapes that get none of their own
    std::array<int, 8> class_of_shape;
    int used = 0;
    for (int shape = 0; shape < 8; ++shape) {
      if (shapes[shape] >= least && used + 1 < classes_left) {
        class_of_shape[shape] = class_count_++;
        ++used;
      } else {
        class_of_shape[shape] = -1;
      }
    }
    for (int shape = 0; shape < 8; ++shape) {
      if (class_of_shape[shape] >= 0 || shapes[shape] == 0) continue;
      if (shared < 0) shared = class_count_++;
      class_of_shape[shape] = shared;
    }
    for (int bin = window.first * 8; bin < window.last * 8 + 8; ++bin)
      if (class_of_shape[bin % 8] >= 0)
        table[bin] = static_cast<std::uint8_t>(class_of_shape[bin % 8]);
  }
  if (histogram[unbounded_octave * 8])
    table[unbounded_octave * 8] = static_cast<std::uint8_t>(class_count_++);
  return table;
}

// Counts bins, and summarises classes by the last frame's table. Where the counts call for another
// table, the summaries are made again.
void CellOrder::survey(const BoxSet& boxes, int threads) {
  surveys_.resize(std::max<std::size_t>(surveys_.size(), threads));
  for (int attempt = 0;; ++attempt) {
    int parts = 1;
    runTeam(threads, [&](int thread, int team) {
      if (thread == 0) parts = team;
      Survey& own = surveys_[thread];
      own.histogram.fill(0);
      for (ClassSummary& summary : own.classes) summary.clear();
      const Range range = partOf(boxes.size, thread, team);
      for (std::size_t slot = range.begin; slot < range.end; ++slot) {
        const Box& box = boxes.boxes[slot];
        if (!isActive(box)) continue;
        const unsigned bin = binOf(box);
        ++own.histogram[bin];
        const std::uint8_t of = table_[bin];
        if (of < max_classes) own.classes[of].add(box);
      }
    });
    total_ = surveys_[0];
    for (int part = 1; part < parts; ++part) {
      for (int bin = 0; bin < bins; ++bin) total_.histogram[bin] += surveys_[part].histogram[bin];
      for (int i = 0; i < max_classes; ++i) total_.classes[i].add(surveys_[part].classes[i]);
    }
    const ClassTable table = chooseClasses(total_.histogram);
    bool fits = true;
    for (int bin = 0; bin < bins; ++bin)
      fits = fits && (total_.histogram[bin] == 0 || table[bin] == table_[bin]);
    if (fits || attempt > 0) return;
    table_ = table;
  }
}

void CellOrder::assignKeys(const BoxSet& boxes, int threads) {
  quantizers_.clear();
  classes_.clear();
  std::uint32_t first_key = 0;
  std::size_t position = 0;
  const bool has_unbounded = total_.histogram[unbounded_octave * 8] > 0;
  for (int i = 0; i < class_count_; ++i) {
    const ClassSummary& summary = total_.classes[i];
    const bool unbounded = has_unbounded && i == class_count_ - 1;
    quantizers_.emplace_back(summary, unbounded ? 0 : digitsFor(summary.count), first_key);
    first_key += quantizers_.back().keys();
    classes_.push_back({position, position + summary.count});
    position += summary.count;
  }
  for (key_bits_ = 0; (first_key - 1) >> key_bits_ && first_key;) ++key_bits_;

  records_.resizeDiscarding(position);
  scratch_.resizeDiscarding(position);
  order_.resizeDiscarding(position);
  // Two passes: a part's boxes go behind those of the parts before it.
  const int parts = threads;
  part_counts_.assign(parts, 0);
  runTeam(parts, [&](int thread, int team) {
    for (int part = thread; part < parts; part += team) {
      const Range range = partOf(boxes.size, part, parts);
      std::size_t count = 0;
      for (std::size_t slot = range.begin; slot < range.end; ++slot)
        count += isActive(boxes.boxes[slot]);
      part_counts_[part] = count;
    }
  });
  std::size_t begin = 0;
  for (std::size_t& count : part_counts_) {
    const std::size_t own = count;
    count = begin;
    begin += own;
  }
  runTeam(parts, [&](int thread, int team) {
    for (int part = thread; part < parts; part += team) {
      const Range range = partOf(boxes.size, part, parts);
      std::uint64_t* out = records_.data() + part_counts_[part];
      for (std::size_t slot = range.begin; slot < range.end; ++slot) {
        const Box& box = boxes.boxes[slot];
        if (!isActive(box)) continue;
        const std::uint32_t key = quantizers_[table_[binOf(box)]].keyOf(box);
        *out++ = std::uint64_t{key} << 32 | slot;
      }
    }
  });
}

// Orders records [begin, end) anew, whose keys do not tell them apart.
void CellOrder::refine(const BoxSet& boxes, std::size_t begin, std::size_t end,
                       std::size_t class_begin, int threads, int round) {
  const Box* const box = boxes.boxes.data();
  if (end - begin <= longest_halved_run) {
    halve(box, records_.data(), begin, end, class_begin);
    return;
  }
  const ClassSummary summary = summarise(box, records_.data(), begin, end);
  bool spread = false;
  for (int axis = 0; axis < 3; ++axis) spread = spread || summary.high[axis] > summary.low[axis];
  constexpr int most_rounds =
      16;  // floats have 24 digits and 8 bits of exponent: far more than needed
  if (!spread || round == most_rounds) return;
  const int digits = digitsFor(summary.count);
  const Quantizer quantizer(summary, digits, 0);
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t slot = slotOf(records_[i]);
    records_[i] = std::uint64_t{quantizer.keyOf(box[slot])} << 32 | slot;
  }
  radixSort(records_.data() + begin, scratch_.data() + begin, end - begin, 32, digits, threads);
  for (std::size_t run = begin; run < end;) {
    std::size_t run_end = run + 1;
    while (run_end < end && keyOf(records_[run_end]) == keyOf(records_[run])) ++run_end;
    if (run_end - run > long_run) refine(boxes, run, run_end, class_begin, threads, round + 1);
    run = run_end;
  }
}

void CellOrder::refineLongRuns(const BoxSet& boxes, int threads) {
  const std::size_t unbounded_begin = total_.histogram[unbounded_octave * 8] && !classes_.empty()
                                          ? classes_.back().begin
                                          : records_.size();
  for (const Class& of : classes_) {
    if (of.begin >= unbounded_begin) break;
    // A run belongs to the part in which it begins. Runs too long for one thread wait for all.
    const std::size_t count = of.end - of.begin;
    const std::size_t shared_run = std::max(count / (4 * threads), longest_halved_run);
    std::vector<std::vector<Range>> waiting(threads);
    ChunkQueue chunks(count, 4096);
    runTeam(threads, [&](int thread, int) {
      Range range;
      while (chunks.next(range)) {
        std::size_t run = of.begin + range.begin;
        const std::size_t end = of.begin + range.end;
        while (run > of.begin && run < end && keyOf(records_[run]) == keyOf(records_[run - 1]))
          ++run;
        while (run < end) {
          std::size_t run_end = run + 1;
          while (run_end < of.end && keyOf(records_[run_end]) == keyOf(records_[run])) ++run_end;
          if (run_end - run > long_run) waiting[thread].push_back({run, run_end});
          run = run_end;
        }
      }
    });
    std::vector<Range> runs;
    for (const std::vector<Range>& part : waiting)
      runs.insert(runs.end(), part.begin(), part.end());
    const auto small = std::partition(runs.begin(), runs.end(), [&](const Range& run) {
      return run.end - run.begin > shared_run;
    });
    for (auto run = runs.begin(); run != small; ++run)
      refine(boxes, run->begin, run->end, of.begin, threads, 0);
    ChunkQueue queue(runs.end() - small, 8);
    runTeam(threads, [&](int, int) {
      Range range;
      while (queue.next(range))
        for (std::size_t i = range.begin; i < range.end; ++i)
          refine(boxes, small[i].begin, small[i].end, of.begin, 1, 0);
    });
  }
}

void CellOrder::build(const BoxSet& boxes, int threads) {
  survey(boxes, threads);
  assignKeys(boxes, threads);
  radixSort(records_.data(), scratch_.data(), records_.size(), 32, key_bits_, threads);
  refineLongRuns(boxes, threads);
  runTeam(threads, [&](int thread, int team) {
    const Range range = partOf(records_.size(), thread, team);
    for (std::size_t i = range.begin; i < range.end; ++i) order_[i] = slotOf(records_[i]);
  });
}

std::size_t CellOrder::bytes() const {
  return records_.bytes() + scratch_.bytes() + order_.bytes() +
         surveys_.capacity() * sizeof(Survey) + quantizers_.capacity() * sizeof(Quantizer);
}

}  // namespace ode_parallel_sap
