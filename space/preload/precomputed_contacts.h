// Contacts that are found before a program that knows dCollide only asks for them.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/floating_point.h"
#include "space/base/tuning.h"
#include "space/contacts/narrow_phase.h"
#include "space/frame/frame.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// The contacts of one space's pairs, while it reports them, for the thread that it reports them to.
// README.md says which calls of dCollide they answer. Whatever changes what dCollide reads of a
// geom of the classes that are precomputed makes it dirty, of which its space hears while it is
// clean, as all geoms are when a report begins.
class PrecomputedContacts final : public LastStage {
 public:
  struct Counts {
    unsigned long long precomputed = 0;  // pairs that were collided beforehand
    unsigned long long used = 0;         // of those, pairs whose contacts were asked for
    unsigned long long contacts = 0;     // of those

    void add(const Counts& more) {
      precomputed += more.precomputed;
      used += more.used;
      contacts += more.contacts;
    }
  };

  // `always`: whether it pays or not.
  explicit PrecomputedContacts(bool always) : always_(always) {}
  ~PrecomputedContacts() override { endReport(); }

  bool prepare(Frame& frame, const PairList& pairs) override;
  void report(const Frame& frame, const PairList& pairs, void* data,
              dNearCallback* callback) override;
  void noteChange(Slot slot) override;
  void noteNewSlots() override { changed_all_ = true; }
  void release() override;
  std::size_t bytes() const override { return bytesOf(list_, kinds_, narrow_phase_); }

  // What dCollide returns, or -1: that is for dCollide to say. Of the pairs that
  // this thread reports.
  static int answer(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts, int skip);
  // From now on nothing is precomputed or answered: there are colliders of the program's.
  static void stop() { stopped_.store(true, std::memory_order_relaxed); }

  const Counts& counts() const { return all_; }

 private:
  using Kind = unsigned char;
  static constexpr Kind kinds = 64;  // as of kindOf()

  // Of a report's pairs of one kind: their number, and by how many the calls of dCollide for
  // `asked` contacts are more than all others.
  struct Habit {
    std::uint32_t pairs = 0, votes = 0;
    int asked = 0;
    int flags = 0;  // with which they are precomputed in this report; 0: they are not

    void vote(int called) {
      if (votes == 0) asked = called;
      votes += called == asked ? 1u : ~0u;
    }
    bool isWorth(double least_share) const {
      return pairs > 0 && votes > 0 &&
             static_cast<double>(votes) >= least_share * static_cast<double>(pairs);
    }
  };

  static Kind kindOf(const dxGeom* o1, const dxGeom* o2);
  void collide(Frame& frame, const PairList& pairs);
  void endReport();
  void learn();
  bool anyChanged() const { return changed_all_ || !changed_.empty(); }
  bool isUnchanged(std::size_t place) const;
  std::size_t placeBehind(const dxGeom* o1, const dxGeom* o2) const;
  int answerOwn(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts, int skip);

  inline static std::atomic<bool> stopped_{false};
  inline static thread_local PrecomputedContacts* reporting_now_ = nullptr;

  const bool always_;
  // What is collided in vain takes about as long as the rest of a frame.
  BackOff back_off_{2 * retry_frames};
  double least_share_ = 0;         // of the pairs, that must be asked for to make it pay
  std::vector<Habit> habits_;      // by kind
  Buffer<dParallelSAPPair> list_;  // of the pairs from the first on
  Buffer<Kind> kinds_;             // of these; `kinds` if a pair was not collided
  NarrowPhase narrow_phase_;
  FloatingPointMode mode_;

  // Of the report that runs.
  bool reporting_ = false;
  PrecomputedContacts* outer_ = nullptr;  // within whose report it runs
  std::size_t next_place_ = 0;            // of the pair after the one that is reported
  std::size_t next_answer_ = 0;           // the place after that of the last one answered
  Pair pair_ = 0;                         // that is reported, and its geoms
  dParallelSAPPair geoms_ = {};
  std::unordered_set<Slot> changed_;
  bool changed_all_ = false;

  Counts last_, all_;  // of the last report, and of all
};

}  // namespace ode_parallel_sap
