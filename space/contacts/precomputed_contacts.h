// Contacts that are found before a program that knows dCollide only asks for them. Sees ODE's
// private headers.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "space/contacts/collide_habits.h"
#include "space/contacts/narrow_phase.h"
#include "space/data/buffer.h"
#include "space/data/floating_point.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

// The contacts of one space's pairs, while it reports them, for the thread that it reports them to.
//
// A call of dCollide is answered if its pair, in this order, is the one being reported or a little
// behind the last one answered; if it was collided beforehand with the same flags and in the same
// floating-point mode; and if no geom of the pair has become dirty, left the space or come to a
// body since. Whatever changes what dCollide reads of a geom of the classes that are precomputed
// makes it dirty, of which its space hears while it is clean, as all geoms are when a report
// begins.
class PrecomputedContacts {
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
  // Geoms by slot, so many.
  struct Scope {
    dxGeom* const* geoms;
    std::size_t slots;
  };
  class Report;

  PrecomputedContacts() = default;
  ~PrecomputedContacts();
  PrecomputedContacts(const PrecomputedContacts&) = delete;
  PrecomputedContacts& operator=(const PrecomputedContacts&) = delete;

  // Collides the pairs of a report, as far as habits have them collided: kinds of which the
  // program has collided this share at least. Returns the number of threads. Without memory nothing
  // is precomputed.
  int precompute(const PairList& pairs, const Scope& scope, double least_share,
                 const NarrowPhase::Way& way);
  void forgetHabits() { habits_.forget(); }
  bool wouldTellAny(double least_share) const { return habits_.wouldTellAny(least_share); }

  // The geom of a slot has moved, changed or gone.
  void noteChange(Slot slot) {
    if (reporting_) takeChange(slot);
  }

  // Geoms come to other slots.
  void noteNewSlots() { changed_any_ = changed_all_ = true; }

  // What dCollide returns, or -1: that is for dCollide to say. Of whatever this thread's callbacks
  // are being told.
  static int answer(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts, int skip);
  // Reports of all threads that are watched: where there is none, answer() knows nothing.
  static const std::atomic<int>& reports() { return reports_; }
  // From now on nothing is precomputed or answered: there are colliders of the program's.
  static void stop() { stopped_.store(true, std::memory_order_relaxed); }

  const NarrowPhase& narrowPhase() const { return narrow_phase_; }
  const Counts& last() const { return last_; }  // of the last report
  const Counts& all() const { return all_; }
  void release();
  std::size_t bytes() const { return bytesOf(list_, narrow_phase_, changed_); }

 private:
  void begin(double least_share, std::size_t slots);
  void tellNothing();
  void endReport();
  void takeChange(Slot slot);
  bool isAsTold(std::size_t place) const;
  std::size_t placeBehind(const dxGeom* o1, const dxGeom* o2) const;
  int answerOwn(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts, int skip);

  static std::atomic<int> reports_;
  static std::atomic<bool> stopped_;
  static thread_local PrecomputedContacts* reporting_now_;

  CollideHabits habits_;
  NarrowPhase narrow_phase_;
  Buffer<dParallelSAPPair> list_;  // of the pairs from the first on
  FloatingPointMode mode_;

  // Of the report that runs.
  bool reporting_ = false;
  PrecomputedContacts* outer_ = nullptr;  // within whose report it runs
  std::size_t slots_ = 0;
  std::size_t next_place_ = 0;   // of the pair after the one that is reported
  std::size_t next_answer_ = 0;  // the place after that of the last one answered
  // That is reported.
  Pair pair_ = 0;
  dParallelSAPPair geoms_ = {};
  int kind_ = -1;  // or -1, where it is to be asked again
  bool changed_any_ = false, changed_all_ = false;
  Buffer<unsigned char> changed_;  // by slot, once there is one

  Counts last_, all_;
};

// While it lives, dCollide on this thread is answered from these contacts, or watched.
class PrecomputedContacts::Report {
 public:
  explicit Report(PrecomputedContacts& contacts);
  ~Report();
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  // The callback is about to be told of this pair, which is the next one.
  void next(Pair pair, dxGeom* o1, dxGeom* o2) {
    contacts_.pair_ = pair;
    contacts_.narrow_phase_.prefetch(contacts_.next_place_++);
    // A geom that was destroyed in this report must not be looked at.
    contacts_.kind_ = contacts_.changed_any_ ? -1 : CollideHabits::kindOf(o1, o2);
    contacts_.geoms_ = {o1, o2};
    contacts_.habits_.notePair(contacts_.kind_);
  }

 private:
  PrecomputedContacts& contacts_;
};

}  // namespace ode_parallel_sap
