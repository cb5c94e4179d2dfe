#include "space/frame/hints.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace ode_parallel_sap {

namespace {

constexpr unsigned long long least_pairs = 16;       // fixed: fewer may be chance
constexpr unsigned long long least_untouched = 100;  // fixed: 3 % at most touch, by 95 in 100
constexpr double least_saved = 0.01;                 // fixed: nobody would notice less

__attribute__((format(printf, 1, 2))) std::string printed(const char* format, ...) {
  char text[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

double share(double part, double whole) {
  return whole > 0 ? part / whole : 0;
}

double share(unsigned long long part, unsigned long long whole) {
  return share(static_cast<double>(part), static_cast<double>(whole));
}

// The share of callbacks' time that a kind has at least, but for chance: three standard deviations
// less. How many pairs were picked is chance, so the variance of a sum is the sum of squares. A few
// callbacks that another program interrupted are not told from long ones, but where they are most
// of a kind's time they are most of its deviation, too.
double leastShareOfReport(const SampledPairs::Kind& kind, const SampledPairs::Kind& all) {
  const double share_of_kind = share(kind.report_ms, all.report_ms), rest = 1 - share_of_kind;
  const double of_others = all.report_ms_squared - kind.report_ms_squared;
  const double deviation = std::sqrt(rest * rest * kind.report_ms_squared +
                                     share_of_kind * share_of_kind * std::max(of_others, 0.0));
  return std::max(0.0, share_of_kind - 3 * share(deviation, all.report_ms));
}

// What callbacks took was measured pair by pair, or is that of pairs with contacts, or of any.
double shareOfReport(const SampledPairs::Kind& kind, const SampledPairs& seen) {
  if (seen.all.report_ms > 0) return share(kind.report_ms, seen.all.report_ms);
  if (seen.all.touching > 0) return share(kind.touching, seen.all.touching);
  return share(kind.pairs, seen.all.pairs);
}
double leastShareOfReport(const SampledPairs::Kind& kind, const SampledPairs& seen) {
  return seen.all.report_ms > 0 ? leastShareOfReport(kind, seen.all) : shareOfReport(kind, seen);
}

// The part of the frames' time that goes with the pairs of a kind, if that is its share of the
// report. Those that the narrow phase passes over cost it nothing.
double savedBy(const SampledPairs::Kind& kind, double share_of_report,
               const FrameSums::Sums& frames, const SampledPairs& seen) {
  if (kind.pairs < least_pairs) return 0;
  const double found = (frames.extract_ms + frames.filter_ms) * share(kind.pairs, seen.all.pairs);
  const double collided = frames.narrow_ms * share(kind.collided, seen.all.collided);
  return share(found + collided + frames.report_ms * share_of_report, frames.total_ms);
}

class Line {
 public:
  Line(const FrameSums::Sums& frames, const SampledPairs& seen) : frames_(frames), seen_(seen) {}

  void add(const SampledPairs::Kind& kind, const std::string& means, const char* pairs) {
    if (savedBy(kind, leastShareOfReport(kind, seen_), frames_, seen_) < least_saved) return;
    const double saved = savedBy(kind, shareOfReport(kind, seen_), frames_, seen_);
    text_ += printed("%s %.0f %% by ", text_.empty() ? "" : ",", 100 * saved) + means +
             printed(" (%.0f %% of the pairs %s)", 100 * share(kind.pairs, seen_.all.pairs), pairs);
  }
  const std::string& text() const { return text_; }

 private:
  const FrameSums::Sums& frames_;
  const SampledPairs& seen_;
  std::string text_;
};

// The categories with most pairs of which none touched. Geoms whose categories the program left as
// they are cannot be kept apart by them.
const SampledPairs::Layers* untouchedLayers(const SampledPairs& seen) {
  const SampledPairs::Layers* most = nullptr;
  for (std::size_t i = 0; i < seen.used_layers; ++i) {
    const SampledPairs::Layers& layers = seen.layers[i];
    if (layers.seen.touching || layers.seen.pairs < least_untouched || ~layers.b == 0) continue;
    if (!most || layers.seen.pairs > most->seen.pairs) most = &layers;
  }
  return most;
}

}  // namespace

std::string hintsOf(const FrameSums::Sums& frames, const SampledPairs& seen) {
  Line line(frames, seen);
  line.add(seen.of_static, "ODE_PARALLEL_SAP_SKIP_STATIC=1", "are of two geoms without bodies");
  line.add(seen.asleep, "ODE_PARALLEL_SAP_SKIP_ASLEEP=1", "have no body that is awake");
  line.add(seen.clear, "ODE_PARALLEL_SAP_CULL_PLANES=1", "are of a plane and what is clear of it");
  if (const SampledPairs::Layers* const layers = untouchedLayers(seen))
    line.add(
        layers->seen,
        printed("collide bits that keep categories 0x%lx and 0x%lx apart", layers->a, layers->b),
        "are of these, and none of them touched");
  if (line.text().empty()) return "";
  return "of the time of frames would have been saved, by each alone:" + line.text();
}

}  // namespace ode_parallel_sap
