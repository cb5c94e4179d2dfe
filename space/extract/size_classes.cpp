#include "space/extract/size_classes.h"

#include <algorithm>
#include <cstring>

#include "space/data/parallel.h"

namespace ode_parallel_sap {

namespace {

// Sizes within a factor of 2^3 share a class: cells of mixed sizes are then at most as wide as
// their largest boxes, and boxes of one size rarely straddle two classes.
constexpr int class_octaves = 3;
// Below this share of all boxes a class of small boxes is not worth a tree of its own.
constexpr std::size_t least_share = 32;
// A shape (long in some axes, short in others) gets a class from this share of its window on.
constexpr std::size_t least_shape_share = 16;
constexpr std::size_t least_shape_count = 64;

Region surveying("size classes: survey");

constexpr std::uint8_t no_class = 0xff;
constexpr int unbounded_octave = 255;

int octaveOf(float extent) {
  std::int32_t bits;
  std::memcpy(&bits, &extent, sizeof bits);
  const bool negative = bits<0, nan = (bits & 0x7fffffff)> 0x7f800000;
  return negative && !nan ? 0 : bits >> 23 & 0xff;
}

}  // namespace

// The octave of the greatest extent, and for each axis whether the extent there is far shorter.
template <class Real>
int SizeClasses<Real>::binOf(const BasicBox<Real>& box) {
  int octave[3];
  for (int axis = 0; axis < 3; ++axis)
    octave[axis] = octaveOf(static_cast<float>(box.upper[axis] - box.lower[axis]));
  const int greatest = std::max({octave[0], octave[1], octave[2]});
  if (greatest == unbounded_octave) return unbounded_octave * shapes;
  int shape = 0;
  for (int axis = 0; axis < 3; ++axis)
    shape |= int{greatest - octave[axis] >= class_octaves} << axis;
  return greatest * shapes + shape;
}

template <class Real>
void SizeClasses<Real>::Survey::clear() {
  if (first <= last) std::fill(&histogram[first], &histogram[last] + 1, 0);
  first = bins;
  last = -1;
  for (ClassSummary<Real>& summary : classes) summary.clear();
}

template <class Real>
void SizeClasses<Real>::Survey::count(int bin) {
  ++histogram[bin];
  first = std::min(first, bin);
  last = std::max(last, bin);
}

template <class Real>
void SizeClasses<Real>::Survey::add(const Survey& other) {
  for (int bin = other.first; bin <= other.last; ++bin) histogram[bin] += other.histogram[bin];
  first = std::min(first, other.first);
  last = std::max(last, other.last);
  for (int i = 0; i < most; ++i) classes[i].add(other.classes[i]);
}

// Takes the fullest run of octaves as a window, then the fullest of the rest, and so on.
template <class Real>
std::vector<typename SizeClasses<Real>::Window> SizeClasses<Real>::chooseWindows(
    const Survey& survey) {
  std::array<std::size_t, octaves> counts = {};
  std::size_t all = 0;
  for (int bin = survey.first; bin <= survey.last; ++bin)
    counts[bin / shapes] += survey.histogram[bin];
  // A window may begin and end in empty octaves.
  const int lowest = std::max(survey.first / shapes - class_octaves + 1, 0);
  const int end = std::min(survey.last / shapes + class_octaves, unbounded_octave);
  for (int octave = lowest; octave < end; ++octave) all += counts[octave];

  std::vector<Window> windows;
  std::array<bool, octaves> taken = {};
  for (std::size_t left = all; left > 0;) {
    Window best = {0, 0, 0};
    for (int first = lowest; first < end; ++first) {
      std::size_t count = 0;
      int last = first;
      for (; last < first + class_octaves && last < end && !taken[last]; ++last)
        count += counts[last];
      if (count > best.count) best = {first, last - 1, count};
    }
    for (int octave = best.first; octave <= best.last; ++octave) taken[octave] = true;
    windows.push_back(best);
    left -= best.count;
  }
  std::sort(windows.begin(), windows.end(),
            [](const Window& a, const Window& b) { return a.first < b.first; });
  // Few small boxes do no harm among larger ones. The last of too many join as well.
  constexpr std::size_t most_windows = most / 2;
  for (std::size_t i = 0; i + 1 < windows.size();) {
    if (windows[i].count < all / least_share || windows.size() > most_windows) {
      windows[i + 1].first = windows[i].first;
      windows[i + 1].count += windows[i].count;
      windows.erase(windows.begin() + i);
    } else {
      ++i;
    }
  }
  return windows;
}

// Splits windows by shape where a shape is common.
template <class Real>
typename SizeClasses<Real>::Table SizeClasses<Real>::chooseTable(const Survey& survey) {
  const Histogram& histogram = survey.histogram;
  const std::vector<Window> windows = chooseWindows(survey);
  Table table;
  table.fill(no_class);
  count_ = 0;
  for (const Window& window : windows) {
    std::array<std::size_t, shapes> counts = {};
    for (int bin = window.first * shapes; bin < (window.last + 1) * shapes; ++bin)
      counts[bin % shapes] += histogram[bin];
    const std::size_t least = std::max(window.count / least_shape_share, least_shape_count);
    const int classes_left = most - 1 - count_ - static_cast<int>(&windows.back() - &window);
    int shared = -1;  // the class of all shapes that get none of their own
    std::array<int, shapes> class_of_shape;
    int used = 0;
    for (int shape = 0; shape < shapes; ++shape) {
      if (counts[shape] >= least && used + 1 < classes_left) {
        class_of_shape[shape] = count_++;
        ++used;
      } else {
        class_of_shape[shape] = -1;
      }
    }
    for (int shape = 0; shape < shapes; ++shape) {
      if (class_of_shape[shape] >= 0 || counts[shape] == 0) continue;
      if (shared < 0) shared = count_++;
      class_of_shape[shape] = shared;
    }
    for (int bin = window.first * shapes; bin < (window.last + 1) * shapes; ++bin)
      if (class_of_shape[bin % shapes] >= 0)
        table[bin] = static_cast<std::uint8_t>(class_of_shape[bin % shapes]);
  }
  has_unbounded_ = histogram[unbounded_octave * shapes] != 0;
  if (has_unbounded_) table[unbounded_octave * shapes] = static_cast<std::uint8_t>(count_++);
  return table;
}

// Counts bins, and summarises classes by the last frame's table. Where the counts call for another
// table, the summaries are made again.
template <class Real>
void SizeClasses<Real>::choose(const BoxSet& boxes, int threads) {
  surveys_.resize(std::max<std::size_t>(surveys_.size(), threads));
  for (int attempt = 0;; ++attempt) {
    int parts = 1;
    runTeam(surveying, threads, [&](int thread, int team) {
      if (thread == 0) parts = team;
      Survey& own = surveys_[thread];
      own.clear();
      const Range range = ownPart(boxes.size, thread, team);
      for (std::size_t slot = range.begin; slot < range.end; ++slot) {
        const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
        if (!isActive(box)) continue;
        const int bin = binOf(box);
        own.count(bin);
        const std::uint8_t of = table_[bin];
        if (of < most) own.classes[of].add(box);
      }
    });
    total_.clear();
    for (int part = 0; part < parts; ++part) total_.add(surveys_[part]);
    const Table table = chooseTable(total_);
    bool fits = true;
    for (int bin = total_.first; bin <= total_.last; ++bin)
      fits = fits && (total_.histogram[bin] == 0 || table[bin] == table_[bin]);
    if (fits || attempt > 0) return;
    table_ = table;
  }
}

template class SizeClasses<float>;
template class SizeClasses<double>;

}  // namespace ode_parallel_sap
