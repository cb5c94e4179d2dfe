#include "cuda/several/share_team.h"

#include <algorithm>
#include <chrono>

#include "cuda/device/spin.h"
#include "cuda/one/lists.h"
#include "cuda/one/scene_plan.h"
#include "space/data/parallel.h"

namespace ode_parallel_sap {

using device::list_block;
using device::segment_words;

namespace {

// fixed: rows that a thread takes at a time: few takers meet at the counter.
constexpr std::size_t rows_at_once = 8;
constexpr std::size_t piece_words = device::piece_segments * segment_words;

Region dealing("device: rows of shares"), joining("device: lists of shares");

bool drivesOnly(int thread, int team, std::size_t devices) {
  return static_cast<std::size_t>(thread) < devices &&
         static_cast<std::size_t>(team) >= devices * device::threads_with_driver_apart;
}

}  // namespace

// Calls work(member, index) for the devices of this thread that have not failed; one that throws
// has.
template <class Work>
void ShareTeam::drive(int thread, int team, Work work) {
  for (std::size_t i = static_cast<std::size_t>(thread); i < count_; i += team) {
    Member& member = *members_[i];
    if (member.failure) continue;
    try {
      const ScopedDevice device(member.driverContext());
      work(member, i);
    } catch (...) {
      member.failure = std::current_exception();
      member.stream.giveUp();
    }
  }
}

// So that drive() finds a driver's first device current, and need not change it again and again.
std::unique_ptr<ScopedDevice> ShareTeam::stayOnDevice(int thread) {
  std::unique_ptr<ScopedDevice> current;
  if (static_cast<std::size_t>(thread) >= count_) return current;
  Member& member = *members_[thread];
  try {
    if (!member.failure) current = std::make_unique<ScopedDevice>(member.driverContext());
  } catch (...) {
    member.failure = std::current_exception();
    member.stream.giveUp();
  }
  return current;
}

bool ShareTeam::failed() const {
  return std::any_of(members_.begin(), members_.begin() + static_cast<std::ptrdiff_t>(count_),
                     [](const auto& member) { return member->failure != nullptr; });
}

// Threads take rows of slots, sort their boxes by share and put them into the streams.
void ShareTeam::deal(const BoxSet& boxes, int thread, int team) {
  const auto current = stayOnDevice(thread);
  const std::size_t rows = (boxes.size + DealtRow::slots - 1) / DealtRow::slots;
  std::vector<char> sent(count_);
  const auto send = [&] {
    const bool all_put = rows_put_.load(std::memory_order_acquire) == rows;
    drive(thread, team, [&](Member& member, std::size_t i) {
      if (!sent[i]) sent[i] = member.stream.drive(all_put);
    });
  };
  drive(thread, team, [&](Member& member, std::size_t) {
    cudaGetLastError();  // not ours
    member.stream.open(*member.sweep, boxes);
  });
  const bool has_devices = static_cast<std::size_t>(thread) < count_;
  int patience = device::spins_before_yield;
  const auto wait = [&] {
    if (has_devices)
      send();
    else if (--patience < 0)
      std::this_thread::yield();
  };
  if (!drivesOnly(thread, team, count_)) {
    DealtRow& row = *rows_[thread];
    for (std::size_t begin; (begin = next_row_.fetch_add(rows_at_once)) < rows;) {
      TeamWatch::noteWork();
      const std::size_t end = std::min(rows, begin + rows_at_once);
      for (std::size_t r = begin; r < end; ++r) {
        row.sort(boxes, r, cuts_);
        for (std::size_t i = 0; i < count_; ++i) members_[i]->stream.put(boxes, r, row, i, wait);
      }
      rows_put_.fetch_add(end - begin, std::memory_order_release);
      if (has_devices) send();
    }
  }
  if (!has_devices) return;
  for (bool all = false; !all;) {
    send();
    all = true;
    drive(thread, team, [&](Member&, std::size_t i) { all = all && sent[i]; });
  }
  drive(thread, team, [&](Member& member, std::size_t i) {
    member.stream.finish(boxes);
    search(boxes, member, i);
  });
  drive(thread, team, [&](Member& member, std::size_t) {
    if (member.stream.boxes() < 2) return;
    member.sweep->finish();
    fetch(member);
  });
}

void ShareTeam::search(const BoxSet& boxes, const Member& member, std::size_t index) {
  if (member.stream.boxes() < 2) return;
  DeviceSweep::Frame frame;
  frame.slots = boxes.size;
  frame.boxes = member.stream.boxes();
  frame.filter_bits = boxes.filter_bits;
  frame.filter_bodies = boxes.filter_bodies;
  frame.exact = boxes.exact;
  frame.share.slot_of = member.sweep->context()->slot_of.data();
  frame.share.axis = cuts_.axis;
  frame.share.first = index == 0 ? 0 : cuts_.at[index - 1];
  member.sweep->start(frame, [] {});
}

// Asks for all lists of a device, and waits only for what says which slots have one.
void ShareTeam::fetch(Member& member) {
  member.pairs = member.sweep->pairs();
  if (member.pairs == 0) return;
  Context& c = *member.sweep->context();
  CHECK_CUDA(cudaEventRecord(c.has_list_here, c.down));
  member.landing.reserve(device::segmentedSize(member.pairs));
  member.sweep->sortLists(piece_words);
  member.pieces = (member.pairs + piece_words - 1) / piece_words;
  while (member.here.size() < member.pieces) member.here.push_back(std::make_unique<Event>());
  const std::size_t piece_size = device::segmentedSize(piece_words);
  for (std::size_t piece = 0; piece < member.pieces; ++piece) {
    const std::size_t words = std::min(piece_words, member.pairs - piece * piece_words);
    CHECK_CUDA(cudaStreamWaitEvent(c.down, *c.ready[piece], 0));
    CHECK_CUDA(cudaMemcpyAsync(
        member.landing.data() + piece * piece_size, c.segments.data() + piece * piece_size,
        device::segmentedEnd(words) * sizeof(std::uint32_t), cudaMemcpyDeviceToHost, c.down));
    CHECK_CUDA(cudaEventRecord(*member.here[piece], c.down));
  }
  CHECK_CUDA(cudaEventSynchronize(c.has_list_here));
}

// Tells how many words have come.
void ShareTeam::watch(Member& member) {
  for (; member.pieces_here < member.pieces; ++member.pieces_here) {
    const cudaError_t status = cudaEventQuery(*member.here[member.pieces_here]);
    if (status == cudaErrorNotReady) break;
    CHECK_CUDA(status);
    member.words_here.store((member.pieces_here + 1) * piece_words, std::memory_order_release);
  }
}

// Waits for the words of a slice; false if they will not come.
bool ShareTeam::waitFor(const Slice& slice, int thread, int team) {
  bool lost = false;
  spinUntil([&] {
    drive(thread, team, [&](Member& member, std::size_t) { watch(member); });
    bool come = true;
    for (std::size_t i = 0; i < count_; ++i) {
      const Member& member = *members_[i];
      come = come && member.words_here.load(std::memory_order_acquire) >= slice.needed[i];
      lost = lost || member.stream.isLost();
    }
    return come || lost;
  });
  return !lost;
}

// Threads take slices in the order in which they can be joined.
void ShareTeam::collect(const BoxSet& boxes, int thread, int team, PairList& pairs) {
  const auto current = stayOnDevice(thread);
  const bool past_caches = pairs.parts[0].size() >= device::too_many_for_caches;
  const Joining joining = {lists_.data(), static_cast<int>(count_), boxes.size, boxes.exact,
                           past_caches,   pairs.parts[0].data()};
  try {
    if (!drivesOnly(thread, team, count_))
      for (std::size_t s; (s = next_slice_.fetch_add(1)) < slices_.size();) {
        if (!waitFor(slices_[s], thread, team)) return;
        TeamWatch::noteWork();
        joiners_[thread].join(joining, slices_[s], borderline_[thread]);
      }
  } catch (...) {
    for (std::size_t i = 0; i < count_; ++i) members_[i]->stream.giveUp();
    throw;
  }
  for (bool all = false; !all;) {
    all = true;
    drive(thread, team, [&](Member& member, std::size_t) {
      watch(member);
      all = all && member.pieces_here == member.pieces;
    });
  }
}

namespace {

class StageClock {
 public:
  float ms() const {
    return std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - begin_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

// A member stays with its device, to which its events belong. Those of this frame come first.
void ShareTeam::enlist(const std::vector<DeviceSweep*>& sweeps) {
  count_ = std::min<std::size_t>(sweeps.size(), most_shares);
  for (std::size_t i = 0; i < count_; ++i) {
    const auto known =
        std::find_if(members_.begin() + static_cast<std::ptrdiff_t>(i), members_.end(),
                     [&](const auto& member) { return member->sweep == sweeps[i]; });
    if (known == members_.end()) {
      members_.insert(members_.begin() + static_cast<std::ptrdiff_t>(i),
                      std::make_unique<Member>());
      members_[i]->sweep = sweeps[i];
    } else {
      std::iter_swap(members_.begin() + static_cast<std::ptrdiff_t>(i), known);
    }
    Member& member = *members_[i];
    member.stream.reset();
    member.failure = nullptr;
    member.pairs = member.pieces = member.pieces_here = 0;
    member.words_here = 0;
  }
}

void ShareTeam::dismiss(const DeviceSweep* sweep) {
  members_.erase(std::remove_if(members_.begin(), members_.end(),
                                [&](const auto& member) { return member->sweep == sweep; }),
                 members_.end());
}

int ShareTeam::find(const BoxSet& boxes, const std::vector<DeviceSweep*>& sweeps, int threads,
                    PairList& pairs, std::vector<std::exception_ptr>& failures) {
  enlist(sweeps);
  const StageClock clock;
  cuts_ = partition_.plan(boxes, static_cast<int>(count_));
  times_.plan = clock.ms();
  next_row_ = rows_put_ = next_slice_ = 0;
  threads = std::max(threads, 1);
  if (joiners_.size() < static_cast<std::size_t>(threads)) joiners_.resize(threads);
  borderline_.resize(joiners_.size());
  while (rows_.size() < joiners_.size()) rows_.push_back(std::make_unique<DealtRow>());
  for (auto& segments : borderline_) segments.clear();

  int used = 1;
  runTeam(dealing, threads, [&](int thread, int team) {
    if (thread == 0) used = team;
    deal(boxes, thread, team);
  });
  times_.search = clock.ms() - times_.plan;
  if (!failed()) {
    prepareJoin(boxes, pairs);
    runTeam(joining, threads, [&](int thread, int team) { collect(boxes, thread, team, pairs); });
    times_.join = clock.ms() - times_.search - times_.plan;
  }
  failures.clear();
  if (failed()) {
    pairs.clear(1);
    // Nothing may be left under way.
    for (std::size_t i = 0; i < count_; ++i) {
      members_[i]->sweep->release();
      failures.push_back(members_[i]->failure);
    }
    return used;
  }
  for (const auto& segments : borderline_)
    pairs.borderline.insert(pairs.borderline.end(), segments.begin(), segments.end());
  return used;
}

// Knows how many pairs there are: their places, and those of the words to come.
void ShareTeam::prepareJoin(const BoxSet& boxes, PairList& pairs) {
  std::vector<Partition::Work> work(count_);
  std::size_t total = 0;
  const std::size_t blocks = (boxes.size + list_block - 1) / list_block;
  lists_.resize(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    Member& member = *members_[i];
    total += member.pairs;
    work[i] = {member.stream.boxes(), member.pairs};
    if (member.pairs == 0) {
      no_begins_.assign(blocks + 1, 0);
      no_lists_.assign((boxes.size + 31) / 32, 0);
      lists_[i] = {nullptr, no_begins_.data(), no_lists_.data()};
      continue;
    }
    const Context& c = *member.sweep->context();
    lists_[i] = {member.landing.data(), c.host_begins.data(), c.host_has_list.data()};
  }
  partition_.learn(work.data());
  pairs.clear(1);
  pairs.parts[0].resizeDiscarding(total);
  slices_ = slicesOf(lists_.data(), static_cast<int>(count_), blocks);
}

std::size_t ShareTeam::bytes() const {
  std::size_t bytes = 0;
  for (const auto& member : members_) bytes += member->landing.bytes() + member->stream.bytes();
  return bytes;
}

}  // namespace ode_parallel_sap
