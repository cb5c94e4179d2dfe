#include "cuda/several/device_group.h"

#include <algorithm>
#include <chrono>

#include "space/base/parallel.h"

namespace ode_parallel_sap {

namespace {

// fixed: each round tells boxes apart by 2^9 of their cluster's range on each axis, or more on
// fewer. Floats span 2^277, so that some scenes need more rounds; clusters are left as they are
// then, which is only slow.
constexpr int most_rounds = 16;

template <class Value>
struct Values {
  const Value* at;
  std::size_t count;
};

template <class T>
void copyBetween(DeviceSweep& to, T* at, const DeviceSweep& from, const T* values,
                 std::size_t count, cudaStream_t stream) {
  if (count)
    CHECK_CUDA(
        cudaMemcpyPeerAsync(at, to.device(), values, from.device(), count * sizeof(T), stream));
}

}  // namespace

// Calls work(member, its number) with its device current.
template <class Work>
void DeviceGroup::each(Work work) {
  for (current_ = 0; current_ < members_.size(); ++current_) {
    const ScopedDevice device(members_[current_]->driverContext());
    work(*members_[current_], current_);
  }
}

template <class Work>
void DeviceGroup::eachOther(std::size_t of, Work work) {
  for (std::size_t i = 0; i < members_.size(); ++i)
    if (i != of) work(*members_[i], i);
}

// Lets devices read each other's memory, where they can. Copies go through the host's otherwise.
void DeviceGroup::link() {
  each([&](DeviceSweep& member, std::size_t index) {
    std::vector<int>& linked = member.context()->linked;
    eachOther(index, [&](DeviceSweep& other, std::size_t) {
      if (other.device() == member.device()) return;
      if (std::find(linked.begin(), linked.end(), other.device()) != linked.end()) return;
      linked.push_back(other.device());
      int can = 0;
      CHECK_CUDA(cudaDeviceCanAccessPeer(&can, member.device(), other.device()));
      if (!can) return;
      const cudaError_t status = cudaDeviceEnablePeerAccess(other.device(), 0);
      if (status != cudaSuccess) cudaGetLastError();
      if (status == cudaSuccess || status == cudaErrorPeerAccessAlreadyEnabled)
        member.context()->readable.push_back(other.device());
    });
  });
}

// Calls use(values, count) with what valuesOf(other) gives of each other member: where they are or,
// of devices whose memory this one cannot read, in copies.
template <class Value, class ValuesOf, class Use>
void DeviceGroup::readOthers(std::size_t index, DeviceBuffer<Value>& copies, ValuesOf valuesOf,
                             Use use) {
  DeviceSweep& member = *members_[index];
  const std::vector<int>& readable = member.context()->readable;
  const auto canRead = [&](const DeviceSweep& other) {
    return std::find(readable.begin(), readable.end(), other.device()) != readable.end();
  };
  std::size_t copied = 0;
  eachOther(index, [&](DeviceSweep& other, std::size_t) {
    if (!canRead(other)) copied += valuesOf(other).count;
  });
  copies.reserve(copied);
  Value* copy = copies.data();
  eachOther(index, [&](DeviceSweep& other, std::size_t) {
    const Values<Value> values = valuesOf(other);
    if (canRead(other)) return use(values.at, values.count);
    copyBetween(member, copy, other, values.at, values.count, member.context()->compute);
    use(copy, values.count);
    copy += values.count;
  });
}

// Makes the devices ready for the boxes of a frame, which have storage.
void DeviceGroup::begin(const BoxSet& boxes) {
  for (DeviceSweep* member : members_) {
    member->checkContext();
    if (member->brought() > 0) member->wait();  // the last frame ended there
  }
  each([](DeviceSweep& member, std::size_t) {
    cudaGetLastError();  // not ours
    member.open();
  });
  const std::uint32_t row_length = members_[0]->wantedRow();
  each([&](DeviceSweep& member, std::size_t index) {
    const device::Part part = {static_cast<std::uint32_t>(index),
                               static_cast<std::uint32_t>(members_.size())};
    member.begin(boxes, part, row_length);
  });
}

void DeviceGroup::bring(const BoxSet& boxes, std::size_t first, std::size_t last) try {
  if (first == 0) begin(boxes);
  if (first != members_[0]->brought()) return;
  each([&](DeviceSweep& member, std::size_t) { member.bring(boxes, last); });
} catch (...) {
  giveUp();
  throw;
}

void DeviceGroup::search(const BoxSet& boxes) {
  if (!boxes.filter_bits && !boxes.filter_bodies && !members_[0]->times) {
    each([](DeviceSweep& member, std::size_t) { member.orderAndSearch(); });
    return;
  }
  each([&](DeviceSweep& member, std::size_t) {
    member.order();
    member.bringFilters(boxes);
  });
  each([](DeviceSweep& member, std::size_t) { member.search(); });
}

// All get what the others have counted, and find their own lists.
void DeviceGroup::shareCounts() {
  each([](DeviceSweep& member, std::size_t) {
    CHECK_CUDA(cudaEventRecord(member.context()->searched, member.context()->compute));
  });
  each([&](DeviceSweep& member, std::size_t index) {
    Context& c = *member.context();
    eachOther(index, [&](DeviceSweep& other, std::size_t) {
      CHECK_CUDA(cudaStreamWaitEvent(c.compute, other.context()->searched, 0));
    });
    device::PartCounts counts = {{c.counts.data()}, 1, member.slots()};
    readOthers(
        index, c.copied_counts,
        [&](DeviceSweep& other) {
          return Values<std::uint32_t>{other.context()->counts.data(), counts.slots};
        },
        [&](const std::uint32_t* of, std::size_t) { counts.of[counts.parts++] = of; });
    member.listOwn(counts);
  });
}

// All take their own pairs of what has been found.
void DeviceGroup::sharePairs() {
  const auto found = [](DeviceSweep& member) {
    return Values<device::Found>{member.context()->found.data(), member.found()};
  };
  each([&](DeviceSweep& member, std::size_t index) {
    member.reserveOwn();
    member.takePairs(found(member).at, found(member).count);
    readOthers(index, member.context()->copied_pairs, found,
               [&](const device::Found* at, std::size_t count) { member.takePairs(at, count); });
    const auto rows = [&](const DeviceSweep& of) {
      const DeviceSweep::OwnRows own = member.ownRowsOf(of);
      return Values<std::uint32_t>{own.words, own.count};
    };
    member.takeRows(rows(member).at);
    readOthers(index, member.context()->copied_rows, rows,
               [&](const std::uint32_t* at, std::size_t) { member.takeRows(at); });
  });
}

bool DeviceGroup::divideClusters(int round) {
  bool divided = false;
  each([&](DeviceSweep& member, std::size_t) { divided = member.divideClusters(round); });
  return divided;
}

// Makes sure that all pairs were found.
void DeviceGroup::complete() {
  bool ignore_clusters = false;
  for (int round = 0;;) {
    if (isShared()) shareCounts();
    bool done = true, clustered = false;
    each([&](DeviceSweep& member, std::size_t) {
      done = member.isDone() && done;
      clustered = member.isClustered() || clustered;
    });
    if (done) break;
    if (clustered && !ignore_clusters)
      ignore_clusters = round == most_rounds || !divideClusters(round++);
    each([&](DeviceSweep& member, std::size_t) { member.searchAgain(ignore_clusters); });
  }
  std::size_t pairs = 0;
  for (const DeviceSweep* member : members_) pairs += member->pairs();
  for (DeviceSweep* member : members_) member->learn(pairs);
}

void DeviceGroup::fetch(PairList& pairs) {
  each([&](DeviceSweep& member, std::size_t part) {
    Buffer<Pair>& to = pairs.parts[part];
    const Pair* const before = to.data();
    to.resizeDiscarding(member.pairs());
    if (to.data() != before) member.openPairs(to);
    member.sendPairs(pairs, part);
  });
  each([&](DeviceSweep& member, std::size_t part) {
    member.finishPairs(pairs, part);
    // Or else it may still be reading what the others found.
    if (isShared() && member.pairs() == 0)
      CHECK_CUDA(cudaStreamSynchronize(member.context()->compute));
  });
}

// Nothing may be left under way, and nothing is known of the state of what is there. A device may
// be reading another's memory.
void DeviceGroup::giveUp() {
  for (DeviceSweep* member : members_) member->wait();
  for (DeviceSweep* member : members_) member->release();
}

void DeviceGroup::find(const BoxSet& boxes, PairList& pairs) {
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::duration<float, std::milli>;
  try {
    if (members_[0]->brought() == 0) begin(boxes);
    pairs.clear(members_.size());
    each([&](DeviceSweep& member, std::size_t index) {
      member.bring(boxes, boxes.size);
      member.setFilters(boxes);
      member.openPairs(pairs.parts[index]);
    });
    if (isShared()) link();
    const Clock::time_point sent = Clock::now();
    each([](DeviceSweep& member, std::size_t) { member.mark(Uploaded); });
    search(boxes);
    complete();
    const Clock::time_point known = Clock::now();
    if (isShared()) sharePairs();
    fetch(pairs);
    if (CudaStageTimes* const times = members_[0]->times) {
      times->host_wait = Milliseconds(known - sent).count();
      times->host_pairs = Milliseconds(Clock::now() - known).count();
      each([](DeviceSweep& member, std::size_t) { member.readTimes(); });
    }
  } catch (...) {
    giveUp();
    throw;
  }
}

}  // namespace ode_parallel_sap
