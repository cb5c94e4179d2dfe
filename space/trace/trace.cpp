#include "space/trace/trace.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <limits>
#include <new>
#include <utility>

#include "space/base/platform.h"

namespace ode_parallel_sap {

namespace {

// That of the process which loaded the library, so not of one that was forked from it.
const long first_process = processNumber();

// Files that were named by openLater() and are begun.
std::atomic<int> files_begun{0};

std::uint32_t wordOf(const PackRules& rules) {
  return (rules.skip_static ? trace_format::skip_static : 0u) |
         (rules.skip_asleep ? trace_format::skip_asleep : 0u) |
         (rules.cull_planes ? trace_format::cull_planes : 0u);
}

}  // namespace

bool Trace::open(const std::string& path) {
  later_.clear();
  process_ = processNumber();
  if (!file_.open(path)) return false;
  bytes_.clear();
  bytes_.put32(trace_format::version);
  bytes_.put32(trace_format::byte_order);
  bytes_.put32(sizeof(dReal));
  bytes_.put32(static_cast<std::uint32_t>(every_));
  bytes_.putText(dGetConfiguration());
  file_.write(trace_format::header_tag, bytes_);
  return file_.isOpen();
}

std::string Trace::nameOfNext() const {
  std::string name = later_;
  const std::string number = std::to_string(processNumber());
  for (std::size_t at = 0; (at = name.find("%p", at)) != std::string::npos; at += number.size())
    name.replace(at, 2, number);
  const int files = files_begun.fetch_add(1) + 1;
  return files == 1 ? name : name + "." + std::to_string(files);
}

bool Trace::openNamed() {
  if (processNumber() != first_process && later_.find("%p") == std::string::npos) {
    later_.clear();
    return false;
  }
  return open(nameOfNext());
}

bool Trace::wantsScene() {
  wants_pairs_ = false;
  const bool due = frames_++ % static_cast<std::uint64_t>(every_) == 0;
  return due && every() != 0;
}

void Trace::seeScene(const Scene& scene, const PackRules& rules) try {
  if (!later_.empty() && !openNamed()) return;
  // After a fork both processes have the file; it is the first one's.
  if (process_ != processNumber()) return;
  bytes_.clear();
  bytes_.put64(frames_);
  bytes_.put32(wordOf(rules));
  bytes_.put32(0);
  const double tolerance = static_cast<double>(rules.tolerance);
  bytes_.putReals(&tolerance, 1);
  changes_.write(scene, bytes_);
  file_.write(trace_format::frame_tag, bytes_);
  wants_pairs_ = rules.tolerance == 0;  // else they depend on the frames before
} catch (const std::bad_alloc&) {
  later_.clear();
  file_.giveUp("out of memory");
}

bool Trace::isDue() {
  pairs_ = sum_ = 0;
  return std::exchange(wants_pairs_, false);
}

void Trace::see(dGeomID a, dGeomID b, int) {
  const auto numberOf = [this](dGeomID geom) { return changes_.numberIn(Slots::slotOf(geom)); };
  ++pairs_;
  sum_ += trace_format::pairSum(numberOf(a), numberOf(b));
}

void Trace::endPairs() try {
  if (process_ != processNumber()) return;
  bytes_.clear();
  bytes_.put64(frames_);
  bytes_.put64(pairs_);
  bytes_.put64(sum_);
  file_.write(trace_format::pairs_tag, bytes_);
} catch (const std::bad_alloc&) {
  file_.giveUp("out of memory");
}

// path[:every]. A colon that no number follows is part of the path.
std::unique_ptr<Trace> Trace::fromEnvironment() {
  const char* const text = std::getenv("ODE_PARALLEL_SAP_TRACE");
  if (!text || !*text) return nullptr;
  std::string path = text;
  int every = 1;
  const std::size_t colon = path.rfind(':');
  if (colon != std::string::npos && colon + 1 < path.size() &&
      path.find_first_not_of("0123456789", colon + 1) == std::string::npos) {
    errno = 0;
    const long number = std::strtol(path.c_str() + colon + 1, nullptr, 10);
    every = static_cast<int>(std::min<long>(number, std::numeric_limits<int>::max()));
    path.resize(colon);
  }
  if (every < 1 || path.empty()) {
    dMessage(0, "ODE_PARALLEL_SAP_TRACE=%s is not a path[:every] and is ignored", text);
    return nullptr;
  }
  auto trace = std::make_unique<Trace>(every);
  trace->openLater(path);
  return trace;
}

}  // namespace ode_parallel_sap
