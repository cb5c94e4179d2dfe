#include "space/contacts/precomputed_contacts.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "space/contacts/contact_pairs.h"

namespace ode_parallel_sap {

std::atomic<int> PrecomputedContacts::reports_{0};
std::atomic<bool> PrecomputedContacts::stopped_{false};
thread_local PrecomputedContacts* PrecomputedContacts::reporting_now_ = nullptr;

namespace {

int flagsOf(void* habits, dGeomID o1, dGeomID o2) {
  return static_cast<const CollideHabits*>(habits)->wantedFlags(CollideHabits::kindOf(o1, o2));
}

constexpr int needs_update = GEOM_DIRTY | GEOM_POSR_BAD;

}  // namespace

PrecomputedContacts::Report::Report(PrecomputedContacts& contacts) : contacts_(contacts) {
  contacts.endReport();
  contacts.outer_ = reporting_now_;
  contacts.reporting_ = true;
  reporting_now_ = &contacts;
  reports_.fetch_add(1, std::memory_order_relaxed);
}

PrecomputedContacts::Report::~Report() {
  contacts_.endReport();
}

PrecomputedContacts::~PrecomputedContacts() {
  endReport();
}

// If there is one: a callback that was left by longjmp has left its report standing.
void PrecomputedContacts::endReport() {
  reporting_ = false;
  for (PrecomputedContacts** told = &reporting_now_; *told; told = &(*told)->outer_) {
    if (*told != this) continue;
    *told = outer_;
    reports_.fetch_sub(1, std::memory_order_relaxed);
    return;
  }
}

void PrecomputedContacts::begin(double least_share, std::size_t slots) {
  habits_.beginReport(least_share);
  slots_ = slots;
  next_place_ = next_answer_ = 0;
  geoms_ = {};
  changed_any_ = changed_all_ = false;
  mode_ = currentMode();
  last_ = {};
  tellNothing();
}

void PrecomputedContacts::tellNothing() {
  list_.resizeDiscarding(0);
  narrow_phase_.precomputeNothing();
}

int PrecomputedContacts::precompute(const PairList& pairs, const Scope& scope, double least_share,
                                    const NarrowPhase::Way& way) try {
  begin(least_share, scope.slots);
  if (stopped_.load(std::memory_order_relaxed)) habits_.tellNothing();
  // Where modes cannot be compared nothing would be answered.
  if (!habits_.tellsAny() || differs(mode_, mode_)) return 1;
  listPairs(pairs, scope.geoms, way.threads, list_);
  ContactRequest request = {&habits_, 0, {}};
  request.callbacks.flags = flagsOf;
  const int threads = narrow_phase_.run(list_, request, way);
  last_.precomputed = narrow_phase_.precomputed();
  all_.precomputed += last_.precomputed;
  return threads;
} catch (const std::bad_alloc&) {
  release();
  return 1;
}

void PrecomputedContacts::release() {
  tellNothing();
  list_ = Buffer<dParallelSAPPair>();
  narrow_phase_ = NarrowPhase();
  changed_ = Buffer<unsigned char>();
}

void PrecomputedContacts::takeChange(Slot slot) {
  if (changed_all_) return;
  if (!changed_any_) {
    changed_any_ = true;
    try {
      changed_.resizeDiscarding(slots_);
      std::fill(changed_.begin(), changed_.end(), 0);
    } catch (const std::bad_alloc&) {
      changed_all_ = true;
      return;
    }
  }
  if (slot < slots_) changed_[slot] = 1;
}

// Once something has changed, of the pair that is reported only: whose slots are known.
bool PrecomputedContacts::isAsTold(std::size_t place) const {
  if (!changed_any_) return true;
  return !changed_all_ && place + 1 == next_place_ && !changed_[earlierOf(pair_)] &&
         !changed_[laterOf(pair_)];
}

// Some programs gather a few pairs before they collide them.
std::size_t PrecomputedContacts::placeBehind(const dxGeom* o1, const dxGeom* o2) const {
  constexpr std::size_t places = 8;  // fixed: some may have been left out, and looking is cheap
  const std::size_t end = std::min(next_answer_ + places, list_.size());
  for (std::size_t place = next_answer_; place < end; ++place)
    if (list_[place].o1 == o1 && list_[place].o2 == o2) return place;
  return list_.size();
}

// Most programs collide the pair that they are being told of. Its kind may be another since; then
// its bodies are, too, and nothing is told.
int PrecomputedContacts::answerOwn(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts,
                                   int skip) {
  const bool reported = o1 == geoms_.o1 && o2 == geoms_.o2;
  const int kind = reported && kind_ >= 0 ? kind_ : CollideHabits::kindOf(o1, o2);
  habits_.noteCall(kind, flags);
  if (habits_.wantedFlags(kind) != flags || flags == 0) return -1;
  const std::size_t place = reported ? next_place_ - 1 : placeBehind(o1, o2);
  if (place >= list_.size() || !isAsTold(place)) return -1;
  if (list_[place].o1 != o1 || list_[place].o2 != o2) return -1;
  if (skip < static_cast<int>(sizeof(dContactGeom)) || !contacts) return -1;
  if ((o1->gflags | o2->gflags) & needs_update) return -1;
  if (differs(mode_, currentMode()) || stopped_.load(std::memory_order_relaxed)) return -1;
  const int count = narrow_phase_.tell(place, {o1, o2}, contacts, skip);
  if (count >= 0 && place >= next_answer_) {
    ++last_.used;
    ++all_.used;
    all_.contacts += static_cast<unsigned long long>(count);
    next_answer_ = place + 1;
  }
  return count;
}

int PrecomputedContacts::answer(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts,
                                int skip) {
  return reporting_now_ && o1 && o2 ? reporting_now_->answerOwn(o1, o2, flags, contacts, skip) : -1;
}

}  // namespace ode_parallel_sap
