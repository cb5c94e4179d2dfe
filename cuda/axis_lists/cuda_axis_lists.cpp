#include "cuda/axis_lists/cuda_axis_lists.h"

#include <algorithm>

#include "cuda/axis_lists/axis_kernels.h"
#include "cuda/axis_lists/axis_parts.h"
#include "cuda/device/device.h"
#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

using device::AxisView;

// fixed: pairs of the fullest axis that are dealt with at a time: bounds what their results may
// take, 128 MB.
constexpr std::uint64_t axis_chunk_pairs = std::uint64_t{1} << 24;

// Pairs that get their slots, filters and marks.
constexpr Grain finished_pairs = {2 * chunk_pairs, Grain::whole};

Region driving("device: axis lists"), finishing("device: pairs of axis lists");

// What one device keeps of its part. The stream comes last, so that it is the first to go: it waits
// for what is under way, and nothing is freed while it is in use.
class DevicePart {
 public:
  explicit DevicePart(int) {}
  // Finds the part's pairs, of its own box numbers, in no particular order.
  void find(const AxisPart& part, const AxisChoice& axes, Buffer<Pair>& found);

 private:
  // An axis as it was sent, and its list.
  struct Axis {
    DeviceBuffer<std::uint64_t> begins;
    DeviceBuffer<std::uint32_t> order, reach, ranks, list;

    std::size_t bytes() const { return bytesOf(begins, order, reach, ranks, list); }
  };
  void reserve(const AxisPart& part, const AxisChoice& axes);
  AxisView sendRows(const AxisRows& rows, Axis& to);

  Axis axes_[3];
  DeviceBuffer<Pair> common_;
  DeviceBuffer<unsigned long long> count_;
  PinnedBuffer<unsigned long long> count_here_;
  Stream stream_;
};

// Counts all that the part needs before anything of it is taken.
void DevicePart::reserve(const AxisPart& part, const AxisChoice& axes) {
  const std::uint64_t own_pairs = part.end() - part.begin();
  const std::uint64_t chunk = std::min(own_pairs, axis_chunk_pairs);
  std::uint64_t needed = chunk * sizeof(Pair) + sizeof(unsigned long long), lists[3];
  for (int axis = 0; axis < 3; ++axis) {
    const AxisRows& rows = part.rows(axis);
    lists[axis] = axis == axes.fullest ? own_pairs : rows.pairs();
    needed += rows.begins.size() * sizeof(std::uint64_t) +
              (2 * rows.order.size() + rows.ranks.size() + lists[axis]) * sizeof(std::uint32_t);
  }
  const std::uint64_t held = bytesOf(axes_) + common_.bytes() + count_.bytes();
  std::uint64_t allowed = most_list_bytes.load(std::memory_order_relaxed);
  if (!allowed && needed > held) {
    std::size_t free = 0, total = 0;
    CHECK_CUDA(cudaMemGetInfo(&free, &total));
    allowed = (free + held) / 2;
  }
  if (allowed && needed > allowed) throw ListsTooLong(needed, allowed);
  for (int axis = 0; axis < 3; ++axis) {
    const AxisRows& rows = part.rows(axis);
    axes_[axis].begins.reserve(rows.begins.size());
    axes_[axis].order.reserve(rows.order.size());
    axes_[axis].reach.reserve(rows.order.size());
    axes_[axis].ranks.reserve(rows.ranks.size());
    axes_[axis].list.reserve(lists[axis]);
  }
  common_.reserve(chunk);
  count_.reserve(1);
  count_here_.reserve(1);
}

// The view's list is the whole axis's.
AxisView DevicePart::sendRows(const AxisRows& rows, Axis& to) {
  const auto send = [&](const auto& from, auto& place) {
    if (from.size())
      CHECK_CUDA(cudaMemcpyAsync(place.data(), from.data(), from.size() * sizeof *from.data(),
                                 cudaMemcpyHostToDevice, stream_));
    return place.data();
  };
  return {send(rows.order, to.order),
          send(rows.ranks, to.ranks),
          send(rows.reach, to.reach),
          send(rows.begins, to.begins),
          to.list.data(),
          0,
          rows.pairs(),
          static_cast<std::uint32_t>(rows.order.size()),
          rows.inverted};
}

void DevicePart::find(const AxisPart& part, const AxisChoice& axes, Buffer<Pair>& found) {
  found.resizeDiscarding(0);
  if (part.begin() == part.end()) return;
  reserve(part, axes);
  AxisView views[3];
  for (int axis = 0; axis < 3; ++axis) views[axis] = sendRows(part.rows(axis), axes_[axis]);
  AxisView& fullest = views[axes.fullest];
  fullest.first = part.begin();
  fullest.last = part.end();
  for (const AxisView& view : views) fillList(view, stream_);
  for (std::uint64_t begin = part.begin(); begin < part.end(); begin += axis_chunk_pairs) {
    device::findCommon({fullest, views[axes.second], views[axes.third]},
                       {begin, std::min(begin + axis_chunk_pairs, part.end())}, common_.data(),
                       count_.data(), stream_);
    CHECK_CUDA(cudaMemcpyAsync(count_here_.data(), count_.data(), sizeof(unsigned long long),
                               cudaMemcpyDeviceToHost, stream_));
    CHECK_CUDA(cudaStreamSynchronize(stream_));
    const std::size_t before = found.size(), count = count_here_[0];
    found.resize(before + count);
    if (count)
      CHECK_CUDA(cudaMemcpyAsync(found.data() + before, common_.data(), count * sizeof(Pair),
                                 cudaMemcpyDeviceToHost, stream_));
    CHECK_CUDA(cudaStreamSynchronize(stream_));
  }
}

}  // namespace

struct CudaAxisLists::Share {
  OnDevice<DevicePart> on;
  AxisPart part;
  Buffer<Pair> found;
};

CudaAxisLists::CudaAxisLists() {
  useDevices({0});
}
CudaAxisLists::~CudaAxisLists() = default;

void CudaAxisLists::useDevices(const std::vector<int>& devices) {
  const bool same =
      std::equal(devices.begin(), devices.end(), shares_.begin(), shares_.end(),
                 [](int device, const Share& share) { return device == share.on.device(); });
  if (same) return;
  shares_.clear();
  for (const int device : devices) shares_.push_back({OnDevice<DevicePart>(device), {}, {}});
}

// One thread a device cuts its part out of the scene, and has its device find the pairs. Returns
// the number of threads.
int CudaAxisLists::findOnDevices(int threads) {
  const AxisChoice axes = chooseAxes(rows_);
  const int count = static_cast<int>(shares_.size());
  int used = 1;
  try {
    used = runTeam(driving, std::min(threads, count), [&](int thread, int team) {
      for (int i = thread; i < count; i += team) {
        noteWork();
        Share& share = shares_[i];
        share.part.cut(rows_, axes, i, count);
        share.on.checkContext();
        const ScopedDevice device(share.on.driverContext());
        cudaGetLastError();  // not ours
        share.on.open();
        share.on.context()->find(share.part, axes, share.found);
      }
    });
  } catch (const ListsTooLong&) {
    throw;  // before anything was begun on that device, and all others are done
  } catch (...) {
    // Nothing may be left under way, and nothing is known of the state of what is there.
    for (Share& share : shares_) share.on.release();
    throw;
  }
  return used;
}

// Slots instead of boxes, filters, marks and order, over the pairs of all devices.
void CudaAxisLists::finish(const BoxSet& boxes, int threads, const PairTest* test,
                           PairList& pairs) {
  std::size_t count = 0;
  for (const Share& share : shares_) count += share.found.size();
  threads = teamFor(count, finished_pairs, threads);
  finished_.start(boxes.size, threads);
  for (const Share& share : shares_) {
    const std::size_t size = share.found.size();
    runChunks(finishing, threads, size, chunkOf(size, chunk_pairs, threads),
              [&](const Range& range, int thread) {
                Pair pair;
                for (std::size_t i = range.begin; i < range.end; ++i)
                  if (writePair(boxes, share.part.slotOf(earlierOf(share.found[i])),
                                share.part.slotOf(laterOf(share.found[i])), &pair) != &pair)
                    finished_.add(thread, pair);
              });
  }
  finished_.writePairs(boxes.exact, threads, test, pairs);
}

int CudaAxisLists::find(const BoxSet& boxes, int threads, PairList& pairs, const PairTest* test) {
  if (boxes.size < 2) {
    pairs.clear(1);
    return 1;
  }
  const ScopedMode mode(exactMode());
  sortAxes(boxes, threads, rows_);
  const int used = findOnDevices(threads);
  finish(boxes, threads, test, pairs);
  return used;
}

std::size_t CudaAxisLists::bytes() const {
  std::size_t bytes = bytesOf(rows_, finished_);
  for (const Share& share : shares_) bytes += bytesOf(share.part, share.found);
  return bytes;
}

}  // namespace ode_parallel_sap
