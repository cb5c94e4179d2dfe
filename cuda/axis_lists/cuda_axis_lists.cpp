#include "cuda/axis_lists/cuda_axis_lists.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "cuda/axis_lists/axis_kernels.h"
#include "cuda/axis_lists/axis_parts.h"
#include "cuda/device/device.h"
#include "cuda/device/devices.h"
#include "space/base/floating_point.h"
#include "space/base/packed_pair_rule.h"
#include "space/base/pair_finder.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/pairs/pair_sort.h"

namespace ode_parallel_sap {

namespace {

using device::AxisView;
using device::CommonCounts;

// fixed: pairs of the fullest axis that are dealt with at a time: bounds what their results may
// take, 256 MB.
constexpr std::uint64_t axis_chunk_pairs = std::uint64_t{1} << 24;

// Pairs that get their slots, filters and marks.
constexpr Grain finished_pairs = {2 * chunk_pairs, Grain::whole};

Region driving("device: axis lists"), finishing("device: pairs of axis lists");

using Clock = std::chrono::steady_clock;
double milliseconds(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

// What one device keeps of its part. The stream comes last, so that it is the first to go: it waits
// for what is under way, and nothing is freed while it is in use.
class DevicePart {
 public:
  explicit DevicePart(int device)
      : processors_(attributeOf(device, cudaDevAttrMultiProcessorCount)) {}
  // Finds the part's pairs, of its own box numbers, in no particular order.
  void find(const AxisPart& part, const AxisChoice& axes, std::uint64_t most_bytes,
            Buffer<Pair>& found);
  std::size_t deviceBytes() const {
    std::size_t bytes = rows_.bytes() + both_.bytes() + all_.bytes() + counts_.bytes();
    for (const DeviceBuffer<std::uint32_t>& list : lists_) bytes += list.bytes();
    return bytes;
  }

 private:
  void reserve(const AxisPart& part, const AxisChoice& axes, std::uint64_t most_bytes);
  void sendRows(const AxisPart& part, AxisView (&views)[3]);

  const int processors_;
  DeviceBuffer<char> rows_;  // of all axes, as they were sent
  DeviceBuffer<std::uint32_t> lists_[3];
  DeviceBuffer<Pair> both_, all_;
  DeviceBuffer<CommonCounts> counts_;
  PinnedBuffer<CommonCounts> counts_here_;
  Stream stream_;
};

// Sizes of the arrays of an axis as they travel: 8-byte begins, then 4-byte arrays.
struct RowsLayout {
  std::size_t begins, ranks, boxes;

  explicit RowsLayout(const AxisRows& rows)
      : begins(rows.begins.size() * sizeof(std::uint64_t)),
        ranks(rows.ranks.size() * sizeof(std::uint32_t)),
        boxes(rows.order.size() * sizeof(std::uint32_t)) {}
  // Every axis begins at a multiple of 8.
  std::size_t bytes() const { return (begins + ranks + 2 * boxes + 7) / 8 * 8; }
};

// Counts all that the part needs before anything of it is taken.
void DevicePart::reserve(const AxisPart& part, const AxisChoice& axes, std::uint64_t most_bytes) {
  std::uint64_t rows = 0, lists[3], all_lists = 0;
  for (int axis = 0; axis < 3; ++axis) {
    rows += RowsLayout(part.rows(axis)).bytes();
    lists[axis] = axis == axes.fullest ? part.end() - part.begin() : part.rows(axis).pairs();
    all_lists += lists[axis];
  }
  const std::uint64_t chunk = std::min(part.end() - part.begin(), axis_chunk_pairs);
  const std::uint64_t needed =
      rows + all_lists * sizeof(std::uint32_t) + 2 * chunk * sizeof(Pair) + sizeof(CommonCounts);
  std::uint64_t allowed = most_bytes;
  if (!most_bytes && needed > deviceBytes()) {
    std::size_t free = 0, total = 0;
    CHECK_CUDA(cudaMemGetInfo(&free, &total));
    allowed = (free + deviceBytes()) / 2;
  }
  if (allowed && needed > allowed) throw ListsTooLong(needed, allowed);
  rows_.reserve(rows);
  for (int axis = 0; axis < 3; ++axis) lists_[axis].reserve(lists[axis]);
  both_.reserve(chunk);
  all_.reserve(chunk);
  counts_.reserve(1);
  counts_here_.reserve(1);
}

void DevicePart::sendRows(const AxisPart& part, AxisView (&views)[3]) {
  std::size_t offset = 0;
  const auto send = [&](const void* from, std::size_t bytes) {
    char* const place = rows_.data() + offset;
    if (bytes) CHECK_CUDA(cudaMemcpyAsync(place, from, bytes, cudaMemcpyHostToDevice, stream_));
    offset += bytes;
    return place;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const AxisRows& rows = part.rows(axis);
    const RowsLayout layout(rows);
    const std::size_t end = offset + layout.bytes();
    AxisView& view = views[axis];
    view.begins = reinterpret_cast<unsigned long long*>(send(rows.begins.data(), layout.begins));
    view.order = reinterpret_cast<std::uint32_t*>(send(rows.order.data(), layout.boxes));
    view.reach = reinterpret_cast<std::uint32_t*>(send(rows.reach.data(), layout.boxes));
    view.ranks = reinterpret_cast<std::uint32_t*>(send(rows.ranks.data(), layout.ranks));
    view.list = lists_[axis].data();
    view.first = 0;
    view.last = rows.pairs();
    view.count = static_cast<std::uint32_t>(rows.order.size());
    view.inverted = rows.inverted;
    offset = end;
  }
}

void DevicePart::find(const AxisPart& part, const AxisChoice& axes, std::uint64_t most_bytes,
                      Buffer<Pair>& found) {
  found.resizeDiscarding(0);
  if (part.begin() == part.end()) return;
  reserve(part, axes, most_bytes);
  AxisView views[3];
  sendRows(part, views);
  AxisView &first = views[axes.fullest], &second = views[axes.second], &third = views[axes.third];
  first.first = part.begin();
  first.last = part.end();
  for (const AxisView& view : views) fillList(view, stream_);
  for (std::uint64_t begin = part.begin(); begin < part.end(); begin += axis_chunk_pairs) {
    device::findCommon({first, second, third},
                       {begin, std::min(begin + axis_chunk_pairs, part.end())},
                       {both_.data(), all_.data(), counts_.data()}, {stream_, processors_});
    CHECK_CUDA(cudaMemcpyAsync(counts_here_.data(), counts_.data(), sizeof(CommonCounts),
                               cudaMemcpyDeviceToHost, stream_));
    CHECK_CUDA(cudaStreamSynchronize(stream_));
    const std::size_t before = found.size(), count = counts_here_[0].all;
    found.resize(before + count);
    if (count)
      CHECK_CUDA(cudaMemcpyAsync(found.data() + before, all_.data(), count * sizeof(Pair),
                                 cudaMemcpyDeviceToHost, stream_));
    CHECK_CUDA(cudaStreamSynchronize(stream_));
  }
}

class CudaAxisLists final : public CudaAxisListsFinder {
 public:
  ~CudaAxisLists() override { releaseDevices(); }
  int find(const BoxSet& boxes, int threads, PairList& pairs) override;
  std::size_t bytes() const override;
  std::size_t deviceBytes() const override;
  void useDevices(const std::vector<int>& devices) override;
  void limit(std::uint64_t most_bytes) override { most_bytes_ = most_bytes; }
  const CudaAxisListsTimes& times() const override { return times_; }

 private:
  // What belongs to one device.
  struct Share {
    int number = 0;
    DriverContext driver_context;
    std::unique_ptr<DevicePart> device;
    // As in DeviceSweep.
    bool isGone() {
      if (device && isLost(driver_context)) (void)device.release();
      return !device;
    }
    AxisPart part;
    Buffer<Pair> found;
  };
  template <class Real>
  int findIn(EndpointLists<Real>& endpoints, const BoxSet& boxes, int threads, PairList& pairs);
  int findOnDevices(const AxisRows* const (&rows)[3], int threads);
  template <class Real>
  void finish(const BoxSet& boxes, int threads, PairList& pairs);
  void releaseDevices();

  std::uint64_t most_bytes_ = 0;
  EndpointLists<float> endpoints_;
  EndpointLists<double> wide_endpoints_;
  std::vector<Share> shares_ = std::vector<Share>(1);
  std::vector<Buffer<Pair>> finished_;  // one a thread
  Buffer<Pair> scratch_;                // to sort with
  CudaAxisListsTimes times_;
};

void CudaAxisLists::releaseDevices() {
  for (Share& share : shares_) {
    if (share.isGone()) continue;
    const ScopedDevice device(share.driver_context, std::nothrow);
    share.device.reset();
  }
}

void CudaAxisLists::useDevices(const std::vector<int>& devices) {
  const bool same =
      std::equal(devices.begin(), devices.end(), shares_.begin(), shares_.end(),
                 [](int number, const Share& share) { return number == share.number; });
  if (same) return;
  releaseDevices();
  shares_ = std::vector<Share>(devices.size());
  for (std::size_t i = 0; i < devices.size(); ++i) shares_[i].number = devices[i];
}

// One thread a device cuts its part out of the scene, and has its device find the pairs. Returns
// the number of threads.
int CudaAxisLists::findOnDevices(const AxisRows* const (&rows)[3], int threads) {
  const AxisChoice axes = chooseAxes({rows[0]->pairs(), rows[1]->pairs(), rows[2]->pairs()});
  const int count = static_cast<int>(shares_.size());
  int used = 1;
  try {
    used = runTeam(driving, std::min(threads, count), [&](int thread, int team) {
      for (int i = thread; i < count; i += team) {
        noteWork();
        Share& share = shares_[i];
        share.part.cut(rows, axes, i, count);
        if (share.device && share.isGone()) throw DeviceWasReset();
        if (!share.device) share.driver_context = driverContextOf(share.number);
        const ScopedDevice device(share.driver_context);
        cudaGetLastError();  // not ours
        if (!share.device) share.device = std::make_unique<DevicePart>(share.number);
        share.device->find(share.part, axes, most_bytes_, share.found);
      }
    });
  } catch (const ListsTooLong&) {
    throw;  // before anything was begun on that device, and all others are done
  } catch (...) {
    // Nothing may be left under way, and nothing is known of the state of what is there.
    releaseDevices();
    throw;
  }
  return used;
}

// Slots instead of boxes, filters, marks and order, over the pairs of all devices.
template <class Real>
void CudaAxisLists::finish(const BoxSet& boxes, int threads, PairList& pairs) {
  std::size_t count = 0;
  for (const Share& share : shares_) count += share.found.size();
  threads = teamFor(count, finished_pairs, threads);
  finished_.resize(threads);
  for (Buffer<Pair>& finished : finished_) finished.resizeDiscarding(0);
  for (const Share& share : shares_) {
    const std::size_t size = share.found.size();
    ChunkQueue queue(size, chunkOf(size, chunk_pairs, threads));
    runTeam(finishing, threads, [&](int thread, int) {
      Buffer<Pair>& to = finished_[thread];
      Range range;
      while (queue.next(range)) {
        const std::size_t before = to.size();
        to.resize(before + (range.end - range.begin));
        Pair* end = to.data() + before;
        for (std::size_t i = range.begin; i < range.end; ++i)
          end = writePair<Real>(boxes, share.part.slotOf(earlierOf(share.found[i])),
                                share.part.slotOf(laterOf(share.found[i])), end);
        to.resize(end - to.data());
      }
    });
  }
  sortPairs(finished_, boxes.size, threads, scratch_, pairs);
}

template <class Real>
int CudaAxisLists::findIn(EndpointLists<Real>& endpoints, const BoxSet& boxes, int threads,
                          PairList& pairs) {
  const Clock::time_point begin = Clock::now();
  endpoints.update(boxes, threads);
  const Clock::time_point sorted = Clock::now();
  const AxisRows* const rows[3] = {&endpoints.axis(0), &endpoints.axis(1), &endpoints.axis(2)};
  const int used = findOnDevices(rows, threads);
  const Clock::time_point found = Clock::now();
  finish<Real>(boxes, threads, pairs);
  times_ = {milliseconds(begin, sorted), milliseconds(sorted, found),
            milliseconds(found, Clock::now())};
  return used;
}

int CudaAxisLists::find(const BoxSet& boxes, int threads, PairList& pairs) {
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  const ScopedMode mode(exactMode());
  return boxes.wide ? findIn(wide_endpoints_, boxes, threads, pairs)
                    : findIn(endpoints_, boxes, threads, pairs);
}

std::size_t CudaAxisLists::bytes() const {
  std::size_t bytes = endpoints_.bytes() + wide_endpoints_.bytes() + scratch_.bytes();
  for (const Share& share : shares_) bytes += share.part.bytes() + share.found.bytes();
  for (const Buffer<Pair>& finished : finished_) bytes += finished.bytes();
  return bytes;
}

std::size_t CudaAxisLists::deviceBytes() const {
  std::size_t bytes = 0;
  for (const Share& share : shares_)
    if (share.device) bytes += share.device->deviceBytes();
  return bytes;
}

}  // namespace

std::unique_ptr<CudaAxisListsFinder> makeCudaAxisLists() {
  return std::make_unique<CudaAxisLists>();
}

}  // namespace ode_parallel_sap
