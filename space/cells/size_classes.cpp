#include "space/cells/size_classes.h"

#include <algorithm>

#include "space/data/parallel.h"

namespace ode_parallel_sap {

namespace {

Region surveying("size classes: survey");

}  // namespace

template <class Real>
int SizeClasses<Real>::binOf(const BasicBox<Real>& box) {
  const auto extent = [&](int axis) {
    return static_cast<float>(box.upper[axis] - box.lower[axis]);
  };
  return size_rules::binOf(extent(0), extent(1), extent(2));
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
std::vector<size_rules::Window> SizeClasses<Real>::chooseWindows(const Survey& survey) {
  using namespace size_rules;
  std::array<std::uint32_t, octaves> counts = {};
  std::uint32_t all = 0;
  for (int bin = survey.first; bin <= survey.last; ++bin)
    counts[bin / shapes] += survey.histogram[bin];
  // A window may begin and end in empty octaves.
  const int lowest = std::max(survey.first / shapes - class_octaves + 1, 0);
  const int end = std::min(survey.last / shapes + class_octaves, unbounded_octave);
  for (int octave = lowest; octave < end; ++octave) all += counts[octave];

  std::vector<Window> windows;
  std::array<bool, octaves> taken = {};
  for (std::uint32_t left = all; left > 0;) {
    Window best = {0, 0, 0};
    for (int first = lowest; first < end; ++first) {
      std::uint32_t count = 0;
      int last = first;
      for (; last < first + class_octaves && last < end && !taken[last]; ++last)
        count += counts[last];
      if (count > best.count) best = {first, last - 1, count};
    }
    for (int octave = best.first; octave <= best.last; ++octave) taken[octave] = true;
    windows.push_back(best);
    left -= best.count;
  }
  windows.resize(static_cast<std::size_t>(
      arrangeWindows(windows.data(), static_cast<int>(windows.size()), all)));
  return windows;
}

// Splits windows by shape where a shape is common.
template <class Real>
typename SizeClasses<Real>::Table SizeClasses<Real>::chooseTable(const Survey& survey) {
  using namespace size_rules;
  const Histogram& histogram = survey.histogram;
  const std::vector<Window> windows = chooseWindows(survey);
  Table table;
  table.fill(no_class);
  count_ = 0;
  for (const Window& window : windows) {
    std::array<std::uint32_t, shapes> counts = {};
    for (int bin = window.first * shapes; bin < (window.last + 1) * shapes; ++bin)
      counts[bin % shapes] += histogram[bin];
    std::array<std::uint8_t, shapes> class_of_shape;
    count_ = splitWindow(counts.data(), window.count, static_cast<int>(&windows.back() - &window),
                         count_, class_of_shape.data());
    for (int bin = window.first * shapes; bin < (window.last + 1) * shapes; ++bin)
      table[bin] = class_of_shape[bin % shapes];
  }
  has_unbounded_ = histogram[unbounded_octave * shapes] != 0;
  if (has_unbounded_) table[unbounded_octave * shapes] = static_cast<std::uint8_t>(count_++);
  return table;
}

// Counts bins, and summarises classes by the last frame's table. Where the counts call for another
// table, the summaries are made again.
template <class Real>
void SizeClasses<Real>::choose(const BoxSet& boxes, int threads, const std::uint8_t* group_of_slot,
                               std::uint8_t group) {
  surveys_.resize(std::max<std::size_t>(surveys_.size(), threads));
  for (int attempt = 0;; ++attempt) {
    const int parts = runTeam(surveying, threads, [&](int thread, int team) {
      Survey& own = surveys_[thread];
      own.clear();
      const Range range = ownPart(boxes.size, thread, team);
      for (std::size_t slot = range.begin; slot < range.end; ++slot) {
        const BasicBox<Real>& box = boxesOf<Real>(boxes)[slot];
        if (!isActive(box) || (group_of_slot && group_of_slot[slot] != group)) continue;
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
