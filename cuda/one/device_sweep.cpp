#include "cuda/one/device_sweep.h"

#include <algorithm>

#include "cuda/one/classify.h"

namespace ode_parallel_sap {

using namespace device;

namespace {

// fixed: a row is whole sectors of memory.
constexpr std::uint32_t least_row = 8;

// Where lists have so many pairs on average: the last length, which spares the frame a new graph,
// unless it is too short or four times too long. Rows of several devices are as long as of one,
// since the device that has a slot's cell finds most of its pairs.
std::uint32_t rowLengthFor(double pairs_a_slot, std::uint32_t last) {
  const double wanted = std::min<double>(pairs_a_slot * row_places_a_pair, most_row);
  if (last >= wanted && last <= std::max<double>(least_row, 4 * wanted)) return last;
  std::uint32_t length = least_row;
  while (length < wanted) length *= 2;
  return length;
}

std::size_t segmentsFor(std::size_t pairs) {
  return (pairs + segment_pairs - 1) / segment_pairs;
}

}  // namespace

void DeviceSweep::wait() {
  brought_ = 0;
  if (isGone()) return;
  const ScopedDevice device(driver_context_, std::nothrow);
  for (const cudaStream_t stream :
       {cudaStream_t(context_->up), cudaStream_t(context_->compute), cudaStream_t(context_->down)})
    cudaStreamSynchronize(stream);
}

std::uint32_t DeviceSweep::wantedRow() const {
  return rowLengthFor(pairs_a_slot_, row_length_);
}

void DeviceSweep::begin(const BoxSet& boxes, const Part& part, std::uint32_t row_length) {
  frame_ = {boxes.size, false, false, false, part};
  row_length_ = row_length;
  Context& c = *context_;
  reserve();
  c.boxes_lock.lock(boxes.boxes.data(), boxes.boxes.bytes(), driver_context_);
  mark(Start);
  clearPlan(c.plan.data(), c.compute);
}

// A copy takes up to twice as long as the kernel if the boxes are still in a processor's caches.
void DeviceSweep::bring(const BoxSet& boxes, std::size_t last) {
  Context& c = *context_;
  const std::size_t first = brought_;
  if (first == last) return;
  const float* from = static_cast<const float*>(c.boxes_lock.mapped());
  if (!from) {
    from = c.boxes.data();
    CHECK_CUDA(cudaMemcpyAsync(reinterpret_cast<Box*>(c.boxes.data()) + first,
                               boxes.boxes.data() + first, (last - first) * sizeof(Box),
                               cudaMemcpyHostToDevice, c.compute));
  }
  survey(from, first, last, c.boxes.data(), c.plan.data(), c.queue());
  brought_ = last;
}

void DeviceSweep::setFilters(const BoxSet& boxes) {
  frame_.filter_bits = boxes.filter_bits;
  frame_.filter_bodies = boxes.filter_bodies;
  frame_.exact = boxes.exact;
  brought_ = 0;
}

template <class Value>
void DeviceSweep::bringFilter(const Buffer<Value>& from, DeviceBuffer<Value>& to, PageLock& lock) {
  to.reserve(frame_.boxes);
  lock.lock(from.data(), from.bytes(), driver_context_);
  CHECK_CUDA(cudaMemcpyAsync(to.data(), from.data(), frame_.boxes * sizeof(Value),
                             cudaMemcpyHostToDevice, context_->up));
}

void DeviceSweep::bringFilters(const BoxSet& boxes) {
  Context& c = *context_;
  if (boxes.filter_bits) bringFilter(boxes.bits, c.bits, c.bits_lock);
  if (boxes.filter_bodies) bringFilter(boxes.bodies, c.bodies, c.bodies_lock);
  follow(c.compute, c.up);
}

// Work on `later` waits for what is on `earlier` so far.
void DeviceSweep::follow(cudaStream_t later, cudaStream_t earlier) {
  CHECK_CUDA(cudaEventRecord(context_->piece_here, earlier));
  CHECK_CUDA(cudaStreamWaitEvent(later, context_->piece_here, 0));
}

void DeviceSweep::openPairs(const Buffer<Pair>& to) {
  context_->pairs_lock.lock(to.data(), to.bytes(), driver_context_);
  host_places_ = to.capacity();
}

void DeviceSweep::reserve() {
  Context& c = *context_;
  const std::size_t boxes = frame_.boxes, slots = boxes, parts = frame_.part.count;
  c.boxes.reserve(boxes * 6);
  c.plan.reserve(1);
  for (int i = 0; i < 2; ++i) {
    c.keys[i].reserve(boxes);
    c.slots[i].reserve(boxes);
  }
  slots_ = c.slots[1].data();
  c.starts.reserve(boxes);
  c.flags.reserve(boxes);
  c.sorted.reserve(boxes * record_bytes);
  c.tree.reserve(TreeLayout(boxes).records * record_bytes);
  c.counts.reserve(slots + 1);
  if (frame_.isShared()) c.all_counts.reserve(slots + 1);
  c.begins.reserve(slots + 1);
  c.long_slots.reserve(slots);
  c.long_offsets.reserve(slots);
  c.host_counters.reserve(1);
  c.rows.reserve(slots * row_length_);
  // Few are beyond rows, but each warp that has some takes chunk_places.
  const std::size_t places = boxes * least_places_a_box / parts;
  reservePairs(std::max(pairs_expected_, places), std::max(beyond_expected_, places / 4));
}

void DeviceSweep::reservePairs(std::size_t pairs, std::size_t beyond) {
  Context& c = *context_;
  c.found.reserve(beyond + overflow_places);
  c.lists.reserve(pairs);
}

void DeviceSweep::orderAndSearch() {
  Context& c = *context_;
  c.graph.run(
      [&] {
        return CachedGraph::Key{frame_.boxes,      c.deviceBytes(),   row_length_,
                                frame_.part.index, frame_.part.count, frame_.exact};
      },
      c.compute,
      [&] {
        order();
        search(false);
      });
  if (!frame_.isShared()) collect();
}

// Orders the boxes along the curve and builds the cells.
void DeviceSweep::order() {
  Context& c = *context_;
  const std::size_t boxes = frame_.boxes;
  const KeyedSlots<std::uint32_t> assigned = {c.keys[0].data(), c.slots[0].data()};
  assignKeys(c.boxes.data(), boxes, c.plan.data(), assigned.keys, assigned.slots, c.queue());
  mark(Classified);
  sortByKey(assigned, {c.keys[1].data(), slots_}, boxes, c.queue());
  mark(Sorted);
  cutCells(c.keys[1].data(), boxes, c.plan.data(), c.flags.data(), c.starts.data(), c.queue());
  buildCells();
  mark(Packed);
}

device::CellStore DeviceSweep::cellStore() {
  return {context_->sorted.data(), context_->tree.data(), frame_.boxes, TreeLayout(frame_.boxes)};
}

device::FoundPairs DeviceSweep::foundPairs() {
  return {rows(), context_->found.data(), context_->foundPlaces()};
}

// What the device's pairs are counted by is used up when they are put into their lists.
device::OpenLists DeviceSweep::openLists() {
  Context& c = *context_;
  return {c.lists.data(), c.lists.capacity(), c.begins.data(), frame_.boxes,
          frame_.isShared() ? c.all_counts.data() : c.counts.data()};
}

void DeviceSweep::buildCells() {
  Context& c = *context_;
  packCells({c.boxes.data(), slots_, frame_.boxes}, c.starts.data(), c.plan.data(), cellStore(),
            c.queue());
}

// Returns whether the order has become any better.
bool DeviceSweep::divideClusters(int round) {
  Context& c = *context_;
  const std::size_t boxes = frame_.boxes;
  for (DeviceBuffer<std::uint64_t>& keys : c.long_keys) keys.reserve(boxes);
  const OrderedBoxes ordered = {c.boxes.data(), slots_, boxes};
  const KeyedSlots<std::uint64_t> divided = {c.long_keys[0].data(), slots_};
  std::uint64_t* const sorted = c.long_keys[1].data();
  const bool any =
      round == 0 ? device::divideClusters(ordered, c.keys[1].data(), c.plan.data(), divided.keys,
                                          c.queue())
                 : device::divideClusters(ordered, sorted, c.plan.data(), divided.keys, c.queue());
  if (!any) return false;
  slots_ = c.slots[slots_ == c.slots[0].data()].data();
  sortByKey(divided, {sorted, slots_}, boxes, c.queue());
  cutCells(sorted, boxes, c.plan.data(), c.flags.data(), c.starts.data(), c.queue());
  buildCells();
  return true;
}

void DeviceSweep::search(bool ignore_clusters) {
  Context& c = *context_;
  CHECK_CUDA(
      cudaMemsetAsync(c.counts.data(), 0, (frame_.boxes + 1) * sizeof(std::uint32_t), c.compute));
  const SearchFilter filter = {
      frame_.filter_bits ? reinterpret_cast<const uint2*>(c.bits.data()) : nullptr,
      frame_.filter_bodies ? c.bodies.data() : nullptr};
  findPairs(cellStore(), {filter, frame_.part, frame_.exact, ignore_clusters}, c.plan.data(),
            foundPairs(), c.counts.data(), c.queue());
  mark(Searched);
  if (frame_.isShared()) return;
  scanCounts(c.counts.data(), c.begins.data(), frame_.boxes, c.queue());
  summarise(c.counts.data());
  scatterPairs(foundPairs(), c.plan.data(), openLists(), c.queue());
  mark(Scattered);
}

void DeviceSweep::search() {
  search(false);
  if (!frame_.isShared()) collect();
}

void DeviceSweep::searchAgain(bool ignore_clusters) {
  clearSearch(context_->plan.data(), ignore_clusters, context_->compute);
  search(ignore_clusters);
  if (!frame_.isShared()) collect();
}

void DeviceSweep::listOwn(const PartCounts& counts) {
  Context& c = *context_;
  const std::size_t slots = frame_.boxes;
  list_rows_ = {};
  list_rows_.length = row_length_;
  for (std::uint32_t part = 0; part < counts.parts; ++part)
    list_rows_.of[part].counts = counts.of[part];
  addCounts(counts, c.all_counts.data(), c.queue());
  scanCounts(c.all_counts.data(), c.begins.data(), slots, c.queue());
  keepOwnLists({c.begins.data(), c.all_counts.data(), slots}, frame_.part, c.plan.data(),
               c.queue());
  summarise(c.all_counts.data());
  collect();
}

// From where the lists will be.
void DeviceSweep::summarise(const std::uint32_t* counts) {
  Context& c = *context_;
  summariseLists(counts, c.begins.data(), frame_.boxes, c.plan.data(),
                 {c.long_slots.data(), c.long_offsets.data()}, c.queue());
  mark(Scanned);
}

// Asks for what the host has to know. One device sorts the lists meanwhile, unless they do not fit.
void DeviceSweep::collect() {
  Context& c = *context_;
  follow(c.down, c.compute);
  CHECK_CUDA(cudaMemcpyAsync(c.host_counters.data(), &c.plan.data()->counters, sizeof(Counters),
                             cudaMemcpyDeviceToHost, c.down));
  CHECK_CUDA(cudaEventRecord(c.result_here, c.down));
  if (!frame_.isShared()) sortShortLists();
}

bool DeviceSweep::isDone() {
  Context& c = *context_;
  CHECK_CUDA(cudaEventSynchronize(c.result_here));
  const bool fits =
      found() <= c.foundPlaces() && (frame_.isShared() || pairs() <= c.lists.capacity());
  pairs_expected_ = pairs() + pairs() / 4;
  // Warps leave some places empty, not always the same number.
  beyond_expected_ = found() + found() / 4;
  const bool done = fits && !isClustered();
  if (!done) CHECK_CUDA(cudaStreamSynchronize(c.compute));  // which may be sorting what there is
  if (!fits) reservePairs(pairs_expected_, beyond_expected_);
  return done;
}

void DeviceSweep::takePairs(const DeviceSweep& of) {
  Context& c = *context_;
  scatterOwnPairs(of.context_->found.data(), of.found(), c.plan.data(), openLists(), c.queue());
  list_rows_.of[list_rows_.parts++].words = of.context_->rows.data();
}

// The host's list, if its pages are locked: a kernel writes it as fast as a copy, and sooner.
Found* DeviceSweep::sortedPairs() {
  void* const mapped = context_->pairs_lock.mapped();
  return mapped ? static_cast<Found*>(mapped) : context_->pairs.data();
}

// Pairs for which there is room in the lists and where they go when they are sorted.
std::size_t DeviceSweep::sortedPlaces() const {
  const Context& c = *context_;
  return std::min(c.lists.capacity(), c.pairs_lock.mapped() ? host_places_ : c.pairs.capacity());
}

// The lists after scatter, and where they go when they are sorted.
Lists DeviceSweep::lists() {
  Context& c = *context_;
  ListRows rows = list_rows_;  // none yet until takePairs
  if (!frame_.isShared()) rows = {{{c.rows.data(), nullptr}}, 1, row_length_};
  return {rows,           c.lists.data(),
          sortedPlaces(), c.begins.data(),
          frame_.boxes,   {sortedPairs(), c.borderline.data()}};
}

void DeviceSweep::sortShortLists() {
  Context& c = *context_;
  const std::size_t segments = segmentsFor(sortedPlaces());
  c.borderline.reserve(segments);
  std::fill_n(c.borderline.data(), segments, std::uint8_t{0});
  sortLists(lists(), c.queue());
  places_sorted_ = sortedPlaces();
}

void DeviceSweep::sendPairs(PairList& to, std::size_t part) {
  Context& c = *context_;
  const std::size_t total = pairs();
  if (total == 0) return mark(Listed);
  const bool at_once = c.pairs_lock.mapped();
  if (!at_once) c.pairs.reserve(total);
  if (frame_.isShared() || total > places_sorted_) sortShortLists();
  const Counters& counters = c.host_counters[0];
  if (counters.long_lists)
    sortLongLists(lists(), {c.long_slots.data(), c.long_offsets.data()}, counters.long_lists,
                  c.long_keys, c.queue());
  mark(Listed);
  if (!at_once)
    CHECK_CUDA(cudaMemcpyAsync(to.parts[part].data(), c.pairs.data(), total * sizeof(Pair),
                               cudaMemcpyDeviceToHost, c.compute));
  CHECK_CUDA(cudaEventRecord(c.result_here, c.compute));
}

void DeviceSweep::finishPairs(PairList& to, std::size_t part) {
  Context& c = *context_;
  const std::size_t total = pairs(), segments = segmentsFor(total);
  if (total == 0) return;
  CHECK_CUDA(cudaEventSynchronize(c.result_here));
  Pair* const first = to.parts[part].data();
  for (std::size_t i = 0; i < segments; ++i)
    to.add({first + i * segment_pairs, first + std::min((i + 1) * segment_pairs, total),
            c.borderline[i] == 0});
}

void DeviceSweep::mark(DeviceStage stage) {
  if (times) CHECK_CUDA(cudaEventRecord(*context_->stage_events[stage], context_->compute));
}

void DeviceSweep::readTimes() {
  if (!times) return;
  const std::vector<std::unique_ptr<Event>>& events = context_->stage_events;
  CHECK_CUDA(cudaEventSynchronize(*events[Listed]));
  float* const stage_ms[] = {&times->upload, &times->classify, &times->sort,    &times->cells,
                             &times->search, &times->scan,     &times->scatter, &times->lists};
  for (int stage = Start; stage < Listed; ++stage)
    CHECK_CUDA(cudaEventElapsedTime(stage_ms[stage], *events[stage], *events[stage + 1]));
}

}  // namespace ode_parallel_sap
