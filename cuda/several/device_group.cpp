#include "cuda/several/device_group.h"

#include <algorithm>
#include <chrono>

namespace ode_parallel_sap {

// fixed: each round tells boxes apart by 2^9 of their cluster's range on each axis, or more on
// fewer. Floats span 2^277, so that some scenes need more rounds; clusters are left as they are
// then, which is only slow.
constexpr int most_rounds = 16;

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

// Whether so many boxes are on their way to each of them, for a scene that these devices share. One
// may have been taken or lost since.
bool DeviceGroup::haveBrought(std::size_t boxes) const {
  return std::all_of(members_.begin(), members_.end(), [&](const DeviceSweep* member) {
    return member->brought() == boxes && member->parts() == members_.size();
  });
}

void DeviceGroup::bring(const BoxSet& boxes, std::size_t first, std::size_t last) try {
  if (first == 0) begin(boxes);
  if (!haveBrought(first)) return;
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
    eachOther(index, [&](DeviceSweep& other, std::size_t) {
      counts.of[counts.parts++] = other.context()->counts.data();
    });
    member.listOwn(counts);
  });
}

// All take their own pairs of what has been found, in the order in which they got the counts.
void DeviceGroup::sharePairs() {
  each([&](DeviceSweep& member, std::size_t index) {
    member.reserveOwn();
    member.takePairs(member);
    eachOther(index, [&](DeviceSweep& other, std::size_t) { member.takePairs(other); });
    member.mark(Scattered);
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
    const std::size_t brought = members_[0]->brought();
    if (brought == 0 || !haveBrought(brought)) begin(boxes);
    pairs.clear(members_.size());
    each([&](DeviceSweep& member, std::size_t index) {
      member.bring(boxes, boxes.size);
      member.setFilters(boxes);
      member.openPairs(pairs.parts[index]);
    });
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
