#include "cuda_sweep.h"

#include <algorithm>
#include <chrono>
#include <cstring>

#include "cells.h"
#include "classify.h"
#include "context.h"
#include "crowds.h"
#include "device.h"

namespace ode_parallel_sap {

namespace {

using namespace device;

// Places for pairs before anything is known of the scene, a box; later what the last frame needed
// and a part more.
constexpr std::size_t first_pairs_a_box = 8;
constexpr std::size_t least_pairs = 1 << 16;

// Each round divides crowds by their own range: this many only if boxes differ by next to nothing.
constexpr int most_rounds = 16;

using Clock = std::chrono::steady_clock;

class CudaSweep final : public CudaPairFinder {
 public:
  explicit CudaSweep(int device) : device_(device) {}
  ~CudaSweep() override { releaseContext(); }

  bool takes(const BoxSet& boxes) const override { return !boxes.wide; }
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  std::size_t bytes() const override { return context_ ? context_->hostBytes() : 0; }
  std::size_t deviceBytes() const override { return context_ ? context_->deviceBytes() : 0; }
  void measure(bool on) override { measuring_ = on; }
  const CudaStageTimes& times() const override { return times_; }

 private:
  void reserve(std::size_t slots);
  void reservePairs(std::size_t pairs);
  void sendBoxes(const BoxSet& boxes, int threads);
  void sendFilters(const BoxSet& boxes, int threads);
  void startSearch(const BoxSet& boxes, int threads);
  void order(std::size_t slots);
  void buildCells(std::size_t slots);
  bool divideCrowds(std::size_t slots, int round);
  void search(const BoxSet& boxes, bool ignore_crowds);
  void collect(const BoxSet& boxes);
  bool findAll(const BoxSet& boxes);
  void sortLists(std::size_t slots, std::size_t total);
  void fetchPairs(const BoxSet& boxes, int threads, PairList& pairs);
  void mark(Stage stage);
  void readTimes(Clock::time_point sent, Clock::time_point known, Clock::time_point done);
  void releaseContext();

  const int device_;
  std::unique_ptr<Context> context_;
  std::size_t pairs_expected_ = 0;
  Pong<std::uint32_t> keys_ = {}, slots_ = {};
  // The same after the sort, which leaves its result in either array; and after the sort that is
  // replayed.
  Pong<std::uint32_t> sorted_keys_ = {}, sorted_slots_ = {};
  Pong<std::uint32_t> recorded_keys_ = {}, recorded_slots_ = {};
  Pong<std::uint64_t> long_keys_ = {};
  int used_ = 1;
  bool measuring_ = false;
  CudaStageTimes times_;
};

void CudaSweep::releaseContext() {
  if (!context_) return;
  try {
    const ScopedDevice device(device_);
    context_.reset();
  } catch (...) {
    context_.reset();
  }
}

int CudaSweep::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (!takes(boxes)) throw DeviceFailure("boxes of doubles are not for the device");
  used_ = 1;
  times_ = {};
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  try {
    const ScopedDevice device(device_);
    cudaGetLastError();  // not ours
    if (!context_) context_ = std::make_unique<Context>(device_);
    reserve(boxes.size);
    mark(Start);
    sendBoxes(boxes, threads);
    const Clock::time_point sent = Clock::now();
    mark(Uploaded);
    startSearch(boxes, threads);
    bool ignore_crowds = false;
    for (int round = 0; !findAll(boxes);) {
      if (context_->host_counters[0].crowded && !ignore_crowds)
        ignore_crowds = round == most_rounds || !divideCrowds(boxes.size, round++);
      search(boxes, ignore_crowds);
      collect(boxes);
    }
    const Clock::time_point known = Clock::now();
    fetchPairs(boxes, threads, pairs);
    if (measuring_) readTimes(sent, known, Clock::now());
  } catch (...) {
    // Nothing may be left under way, and nothing is known of the state of what is there.
    releaseContext();
    throw;
  }
  return used_;
}

void CudaSweep::reserve(std::size_t slots) {
  Context& c = *context_;
  const std::size_t blocks = (slots + list_block - 1) / list_block;
  c.boxes.reserve(slots * 6);
  c.plan.reserve(1);
  for (int i = 0; i < 2; ++i) {
    c.keys[i].reserve(slots);
    c.slots[i].reserve(slots);
  }
  keys_ = {c.keys[0].data(), c.keys[1].data()};
  slots_ = {c.slots[0].data(), c.slots[1].data()};
  c.starts.reserve(slots);
  c.flags.reserve(slots);
  c.sorted.reserve(slots * record_bytes);
  c.tree.reserve(TreeLayout(slots).records * record_bytes);
  c.counts.reserve(slots + 1);
  c.ends.reserve(slots + 1);
  c.block_begins.reserve(blocks + 1);
  c.has_list.reserve((slots + 31) / 32);
  c.long_slots.reserve(slots);
  c.host_counters.reserve(1);
  c.host_begins.reserve(blocks + 1);
  c.host_has_list.reserve((slots + 31) / 32);
  reservePairs(std::max(pairs_expected_, std::max(slots * first_pairs_a_box, least_pairs)));
}

void CudaSweep::reservePairs(std::size_t pairs) {
  Context& c = *context_;
  c.found.reserve(pairs + overflow_places);
  c.lists.reserve(c.pairPlaces());
  c.stretches.reserve(stretchedSize(c.pairPlaces()));
}

// Boxes are counted by bin piece by piece, while the next ones travel.
void CudaSweep::sendBoxes(const BoxSet& boxes, int threads) {
  Context& c = *context_;
  clearPlan(c.plan.data(), c.compute);
  const auto sent = [&](std::size_t begin, std::size_t end) {
    CHECK_CUDA(cudaEventRecord(c.piece_here, c.up));
    CHECK_CUDA(cudaStreamWaitEvent(c.compute, c.piece_here, 0));
    survey(c.boxes.data(), begin / sizeof(Box), end / sizeof(Box), c.plan.data(), c.compute);
  };
  used_ = std::max(used_, c.upload.run(boxes.boxes.data(), c.boxes.data(), boxes.size * sizeof(Box),
                                       sizeof(Box), threads, c.up, sent));
}

void CudaSweep::sendFilters(const BoxSet& boxes, int threads) {
  Context& c = *context_;
  const auto send = [&](const void* from, void* to, std::size_t bytes, std::size_t element) {
    c.upload.run(from, to, bytes, element, threads, c.up, [](std::size_t, std::size_t) {});
  };
  if (boxes.filter_bits) {
    c.bits.reserve(boxes.size);
    send(boxes.bits.data(), c.bits.data(), boxes.size * sizeof(FilterBits), sizeof(FilterBits));
  }
  if (boxes.filter_bodies) {
    c.bodies.reserve(boxes.size);
    send(boxes.bodies.data(), c.bodies.data(), boxes.size * sizeof(std::uint32_t),
         sizeof(std::uint32_t));
  }
  CHECK_CUDA(cudaEventRecord(c.filters_here, c.up));
  CHECK_CUDA(cudaStreamWaitEvent(c.compute, c.filters_here, 0));
}

// The first search of a frame, as far as the host does not have to know anything: in one call where
// frames repeat themselves.
void CudaSweep::startSearch(const BoxSet& boxes, int threads) {
  Context& c = *context_;
  if (boxes.filter_bits || boxes.filter_bodies || measuring_) {
    order(boxes.size);
    sendFilters(boxes, threads);
    search(boxes, false);
  } else {
    c.graph.run(
        [&] {
          return CachedGraph::Key{boxes.size, c.deviceBytes(), boxes.exact};
        },
        c.compute,
        [&] {
          order(boxes.size);
          recorded_keys_ = sorted_keys_;
          recorded_slots_ = sorted_slots_;
          search(boxes, false);
        });
    sorted_keys_ = recorded_keys_;
    sorted_slots_ = recorded_slots_;
  }
  collect(boxes);
}

// Orders the boxes along the curve and builds the cells.
void CudaSweep::order(std::size_t slots) {
  Context& c = *context_;
  assignKeys(c.boxes.data(), slots, c.plan.data(), keys_.current, slots_.current, c.compute);
  mark(Classified);
  sortByKey(keys_, slots_, slots, c.scratch, c.compute);
  sorted_keys_ = keys_;
  sorted_slots_ = slots_;
  mark(Sorted);
  cutCells(keys_.current, slots, c.plan.data(), c.flags.data(), c.starts.data(), c.scratch,
           c.compute);
  buildCells(slots);
  mark(Packed);
}

void CudaSweep::buildCells(std::size_t slots) {
  Context& c = *context_;
  packCells(c.boxes.data(), slots_.current, c.starts.data(), slots, c.plan.data(), c.sorted.data(),
            c.tree.data(), TreeLayout(slots), c.compute);
}

// Returns whether the order has become any better.
bool CudaSweep::divideCrowds(std::size_t slots, int round) {
  Context& c = *context_;
  for (DeviceBuffer<std::uint64_t>& keys : c.long_keys) keys.reserve(slots);
  if (round == 0) {
    keys_ = sorted_keys_;
    slots_ = sorted_slots_;
    long_keys_ = {c.long_keys[0].data(), c.long_keys[1].data()};
  }
  const bool divided =
      round == 0 ? device::divideCrowds(c.boxes.data(), slots_.current, keys_.current, slots,
                                        c.plan.data(), long_keys_.current, c.scratch, c.compute)
                 : device::divideCrowds(c.boxes.data(), slots_.current, long_keys_.current, slots,
                                        c.plan.data(), long_keys_.other, c.scratch, c.compute);
  if (!divided) return false;
  if (round > 0) long_keys_.swap();
  sortByKey(long_keys_, slots_, slots, c.scratch, c.compute);
  cutCells(long_keys_.current, slots, c.plan.data(), c.flags.data(), c.starts.data(), c.scratch,
           c.compute);
  buildCells(slots);
  return true;
}

// Finds the pairs, and where their lists will be.
void CudaSweep::search(const BoxSet& boxes, bool ignore_crowds) {
  Context& c = *context_;
  const std::size_t slots = boxes.size;
  CHECK_CUDA(cudaMemsetAsync(c.counts.data(), 0, (slots + 1) * sizeof(std::uint32_t), c.compute));
  const SearchFilter filter = {
      boxes.filter_bits ? reinterpret_cast<const uint2*>(c.bits.data()) : nullptr,
      boxes.filter_bodies ? c.bodies.data() : nullptr};
  findPairs(c.sorted.data(), c.tree.data(), slots, TreeLayout(slots), filter, boxes.exact,
            c.plan.data(), c.found.data(), c.pairPlaces(), c.counts.data(), ignore_crowds,
            c.processors, c.compute);
  mark(Searched);
  scanCounts(c.counts.data(), c.ends.data(), slots, c.scratch, c.compute);
  summariseLists(c.counts.data(), c.ends.data(), slots, c.plan.data(), c.has_list.data(),
                 c.block_begins.data(), c.long_slots.data(), c.compute);
  mark(Scanned);
}

// Asks for what the host has to know, and has the pairs put into their lists meanwhile.
void CudaSweep::collect(const BoxSet& boxes) {
  Context& c = *context_;
  const std::size_t slots = boxes.size, blocks = (slots + list_block - 1) / list_block;
  CHECK_CUDA(cudaEventRecord(c.summarised, c.compute));
  scatterPairs(c.found.data(), c.pairPlaces(), c.plan.data(), c.ends.data(), c.lists.data(),
               c.processors, c.compute);
  mark(Scattered);

  CHECK_CUDA(cudaStreamWaitEvent(c.down, c.summarised, 0));
  CHECK_CUDA(cudaMemcpyAsync(c.host_counters.data(), &c.plan.data()->counters, sizeof(Counters),
                             cudaMemcpyDeviceToHost, c.down));
  CHECK_CUDA(cudaMemcpyAsync(c.host_begins.data(), c.block_begins.data(),
                             (blocks + 1) * sizeof(unsigned long long), cudaMemcpyDeviceToHost,
                             c.down));
  CHECK_CUDA(cudaEventRecord(c.result_here, c.down));
  CHECK_CUDA(cudaMemcpyAsync(c.host_has_list.data(), c.has_list.data(),
                             (slots + 31) / 32 * sizeof(std::uint32_t), cudaMemcpyDeviceToHost,
                             c.down));
}

// Waits for the number of pairs. False if the search has to be made again: for want of places, of
// which there are enough then, or in a crowd.
bool CudaSweep::findAll(const BoxSet& boxes) {
  Context& c = *context_;
  CHECK_CUDA(cudaEventSynchronize(c.result_here));
  const Counters& counters = c.host_counters[0];
  const std::size_t total = c.host_begins[(boxes.size + list_block - 1) / list_block];
  pairs_expected_ = total + total / 4;
  const bool fits = counters.found <= c.pairPlaces();
  if (!fits) {
    // Warps leave some places empty, not always the same number.
    pairs_expected_ = std::max<std::size_t>(pairs_expected_, counters.found + counters.found / 16);
    reservePairs(pairs_expected_);
  }
  const bool done = fits && !counters.crowded;
  if (!done) clearSearch(c.plan.data(), c.compute);
  return done;
}

// Sorts the lists in the order in which they leave. Piece i of the download may leave after
// ready[i].
void CudaSweep::sortLists(std::size_t slots, std::size_t total) {
  Context& c = *context_;
  const std::size_t blocks = (slots + list_block - 1) / list_block;
  const std::size_t pieces = Download::piecesFor(total);
  while (c.ready.size() < pieces) c.ready.push_back(std::make_unique<Event>());
  const unsigned long long* const begins = c.host_begins.data();
  const std::uint32_t long_lists = c.host_counters[0].long_lists;
  std::size_t block = 0;
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    const std::size_t words = std::min(total, (piece + 1) * Download::pieceWords(total));
    // Up to the first block that begins at or after the piece's end.
    const std::size_t end =
        words == total ? blocks : std::lower_bound(begins + block, begins + blocks, words) - begins;
    device::sortLists(c.lists.data(), c.ends.data(), slots, block, end, c.stretches.data(),
                      c.compute);
    block = end;
    if (!long_lists) CHECK_CUDA(cudaEventRecord(*c.ready[piece], c.compute));
  }
  if (long_lists) {
    sortLongLists(c.lists.data(), c.ends.data(), slots, c.long_slots.data(), long_lists,
                  c.host_counters[0].long_words, c.long_store, c.stretches.data(), c.scratch,
                  c.compute);
    for (std::size_t piece = 0; piece < pieces; ++piece)
      CHECK_CUDA(cudaEventRecord(*c.ready[piece], c.compute));
  }
  mark(Listed);
}

void CudaSweep::fetchPairs(const BoxSet& boxes, int threads, PairList& pairs) {
  Context& c = *context_;
  const std::size_t slots = boxes.size, blocks = (slots + list_block - 1) / list_block;
  const std::size_t total = c.host_begins[blocks];
  sortLists(slots, total);
  used_ = std::max(used_, c.download.run(c.stretches.data(), total, c.ready, c.host_has_list.data(),
                                         boxes.exact, threads, c.down, pairs));
}

void CudaSweep::mark(Stage stage) {
  if (measuring_) CHECK_CUDA(cudaEventRecord(*context_->stage_events[stage], context_->compute));
}

void CudaSweep::readTimes(Clock::time_point sent, Clock::time_point known, Clock::time_point done) {
  CHECK_CUDA(cudaEventSynchronize(*context_->stage_events[Listed]));
  const auto between = [this](Stage begin, Stage end) {
    float ms = 0;
    CHECK_CUDA(
        cudaEventElapsedTime(&ms, *context_->stage_events[begin], *context_->stage_events[end]));
    return ms;
  };
  times_.upload = between(Start, Uploaded);
  times_.classify = between(Uploaded, Classified);
  times_.sort = between(Classified, Sorted);
  times_.cells = between(Sorted, Packed);
  times_.search = between(Packed, Searched);
  times_.scan = between(Searched, Scanned);
  times_.scatter = between(Scanned, Scattered);
  times_.lists = between(Scattered, Listed);
  const auto ms = [](Clock::time_point begin, Clock::time_point end) {
    return std::chrono::duration<float, std::milli>(end - begin).count();
  };
  times_.host_wait = ms(sent, known);
  times_.host_pairs = ms(known, done);
}

}  // namespace

std::unique_ptr<CudaPairFinder> makeCudaSweep(int device) {
  return std::make_unique<CudaSweep>(device);
}

}  // namespace ode_parallel_sap
