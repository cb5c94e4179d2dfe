// The sweep on several devices at once.
#ifndef ODE_PARALLEL_SAP_CUDA_SHARE_TEAM_H
#define ODE_PARALLEL_SAP_CUDA_SHARE_TEAM_H

#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <vector>

#include "cuda/one/device_sweep.h"
#include "cuda/several/deal.h"
#include "cuda/several/join.h"
#include "cuda/several/partition.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// Cuts a scene into a share for each device, lets all find their pairs, and joins the lists. One
// thread drives each device; all others, and the drivers where threads are few, deal boxes and join
// lists.
class ShareTeam {
 public:
  // Fills `pairs` and returns the number of threads used. Where devices fail the others finish what
  // they have begun; then `failures` has one entry a device, null for those that did not fail, and
  // `pairs` is empty. Without a failure it is empty.
  int find(const BoxSet& boxes, const std::vector<DeviceSweep*>& sweeps, int threads,
           PairList& pairs, std::vector<std::exception_ptr>& failures);
  // Before a device that has taken part is destroyed.
  void dismiss(const DeviceSweep* sweep);
  std::size_t bytes() const;

  // Milliseconds of the last find(), on the host.
  struct Times {
    float plan = 0;    // cuts chosen
    float search = 0;  // from there until the last device knows its pairs
    float join = 0;    // from there until the last pair is written
  };
  const Times& times() const { return times_; }

 private:
  struct Member {
    ~Member() { leaving.emplace(driver_context, std::nothrow); }
    DriverContext driverContext() { return driver_context = sweep->driverContext(); }

    std::optional<ScopedDevice> leaving;  // destroyed last: the others have their device current
    DeviceSweep* sweep = nullptr;
    DriverContext driver_context = nullptr;
    DealStream stream;
    PinnedBuffer<std::uint32_t> landing;  // the segments that have come
    std::vector<std::unique_ptr<Event>> here;
    std::size_t pairs = 0, pieces = 0, pieces_here = 0;
    std::exception_ptr failure;
    alignas(64) std::atomic<unsigned long long> words_here{0};
  };

  void enlist(const std::vector<DeviceSweep*>& sweeps);
  void deal(const BoxSet& boxes, int thread, int team);
  void search(const BoxSet& boxes, const Member& member, std::size_t index);
  void prepareJoin(const BoxSet& boxes, PairList& pairs);
  void fetch(Member& member);
  void watch(Member& member);
  bool waitFor(const Slice& slice, int thread, int team);
  void collect(const BoxSet& boxes, int thread, int team, PairList& pairs);
  bool failed() const;
  std::unique_ptr<ScopedDevice> stayOnDevice(int thread);
  template <class Work>
  void drive(int thread, int team, Work work);

  Partition partition_;
  Cuts cuts_;
  std::vector<std::unique_ptr<Member>> members_;
  std::vector<ShareLists> lists_;
  std::vector<unsigned long long> no_begins_;  // of a device that found nothing
  std::vector<std::uint32_t> no_lists_;
  std::vector<Slice> slices_;
  // One a thread.
  std::vector<std::unique_ptr<DealtRow>> rows_;
  std::vector<Joiner> joiners_;
  std::vector<std::vector<PairList::Segment>> borderline_;
  std::atomic<std::size_t> next_row_{0}, rows_put_{0}, next_slice_{0};
  std::size_t count_ = 0;
  Times times_;
};

}  // namespace ode_parallel_sap

#endif
