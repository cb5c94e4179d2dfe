#include "space/contacts/foretold_contacts.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "space/contacts/contact_pairs.h"

namespace ode_parallel_sap {

std::atomic<int> ForetoldContacts::reports_{0};
std::atomic<bool> ForetoldContacts::stopped_{false};
thread_local ForetoldContacts* ForetoldContacts::told_now_ = nullptr;

namespace {

int flagsOf(void* habits, dGeomID o1, dGeomID o2) {
  return static_cast<const CollideHabits*>(habits)->told(CollideHabits::kindOf(o1, o2));
}

constexpr int needs_update = GEOM_DIRTY | GEOM_POSR_BAD;

}  // namespace

ForetoldContacts::Report::Report(ForetoldContacts& contacts) : contacts_(contacts) {
  contacts.outer_ = told_now_;
  contacts.reporting_ = true;
  told_now_ = &contacts;
  reports_.fetch_add(1, std::memory_order_relaxed);
}

ForetoldContacts::Report::~Report() {
  reports_.fetch_sub(1, std::memory_order_relaxed);
  told_now_ = contacts_.outer_;
  contacts_.reporting_ = false;
}

// A callback that was left by longjmp has left its report standing.
ForetoldContacts::~ForetoldContacts() {
  for (ForetoldContacts** told = &told_now_; *told; told = &(*told)->outer_) {
    if (*told != this) continue;
    *told = outer_;
    reports_.fetch_sub(1, std::memory_order_relaxed);
    return;
  }
}

void ForetoldContacts::begin(double least_share, std::size_t slots) {
  habits_.beginReport(least_share);
  slots_ = slots;
  next_place_ = next_answer_ = 0;
  geoms_ = {};
  changed_any_ = changed_all_ = false;
  mode_ = currentMode();
  last_ = {};
  tellNothing();
}

void ForetoldContacts::tellNothing() {
  list_.resizeDiscarding(0);
  narrow_phase_.foretellNothing();
}

int ForetoldContacts::foretell(const PairList& pairs, const Scope& scope, double least_share,
                               const NarrowPhase::Way& way) try {
  begin(least_share, scope.slots);
  if (stopped_.load(std::memory_order_relaxed)) habits_.tellNothing();
  // Where modes cannot be compared nothing would be answered.
  if (!habits_.tellsAny() || differs(mode_, mode_)) return 1;
  listPairs(pairs, scope.geoms, way.threads, list_);
  ContactRequest request = {&habits_, 0, {}};
  request.callbacks.flags = flagsOf;
  const int threads = narrow_phase_.run(list_, request, way);
  last_.told = narrow_phase_.told();
  all_.told += last_.told;
  return threads;
} catch (const std::bad_alloc&) {
  release();
  return 1;
}

void ForetoldContacts::release() {
  tellNothing();
  list_ = Buffer<GeomPair>();
  narrow_phase_ = NarrowPhase();
  changed_ = Buffer<unsigned char>();
}

void ForetoldContacts::takeChange(Slot slot) {
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
bool ForetoldContacts::isAsTold(std::size_t place) const {
  if (!changed_any_) return true;
  return !changed_all_ && place + 1 == next_place_ && !changed_[earlierOf(pair_)] &&
         !changed_[laterOf(pair_)];
}

// Some programs gather a few pairs before they collide them.
std::size_t ForetoldContacts::placeBehind(const dxGeom* o1, const dxGeom* o2) const {
  constexpr std::size_t places = 8;  // fixed: some may have been left out, and looking is cheap
  const std::size_t end = std::min(next_answer_ + places, list_.size());
  for (std::size_t place = next_answer_; place < end; ++place)
    if (list_[place].o1 == o1 && list_[place].o2 == o2) return place;
  return list_.size();
}

// Most programs collide the pair that they are being told of. Its kind may be another since; then
// its bodies are, too, and nothing is told.
int ForetoldContacts::answerOwn(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts,
                                int skip) {
  const bool reported = o1 == geoms_.o1 && o2 == geoms_.o2;
  const int kind = reported && kind_ >= 0 ? kind_ : CollideHabits::kindOf(o1, o2);
  habits_.noteCall(kind, flags);
  if (habits_.told(kind) != flags || flags == 0) return -1;
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

int ForetoldContacts::answer(dxGeom* o1, dxGeom* o2, int flags, dContactGeom* contacts, int skip) {
  return told_now_ && o1 && o2 ? told_now_->answerOwn(o1, o2, flags, contacts, skip) : -1;
}

}  // namespace ode_parallel_sap
