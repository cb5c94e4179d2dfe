#include "space/ode/ode_space.h"

#if defined(__linux__)
#include <pthread.h>
#endif

#include <chrono>
#include <new>
#include <optional>
#include <typeinfo>
#include <utility>

#include "space/base/tuning.h"
#include "space/base/validate.h"
#include "space/frame/without_memory.h"
#include "space/geoms/geom_tests.h"
#include "space/geoms/pair_rule.h"
#include "space/ode/environment.h"

namespace ode_parallel_sap {

namespace {

// Whether a space of the process ever had swept bounds.
std::atomic<bool> any_swept{false};
// How often any geom of any space was said to have changed.
std::atomic<unsigned> notify_all_calls{0};

bool odeAsserts() {
  static const bool asserts = dCheckConfiguration("ODE_EXT_no_debug") == 0;
  return asserts;
}

// The stack that the system gave the calling thread; empty where that is not known.
struct Stack {
  const char *begin = nullptr, *end = nullptr;
  Stack() {
#if defined(__linux__)
    pthread_attr_t attributes;
    void* lowest;
    std::size_t size;
    if (pthread_getattr_np(pthread_self(), &attributes) != 0) return;
    if (pthread_attr_getstack(&attributes, &lowest, &size) == 0) {
      begin = static_cast<const char*>(lowest);
      end = begin + size;
    }
    pthread_attr_destroy(&attributes);
#endif
  }
  bool holds(const char* place) const {
    return begin <= place && place < end;
  }
};

// Stacks grow downwards.
bool hasEnded(const Workspace& workspace, const char* now) {
  if (workspace.taken_at > now) return false;
  static thread_local const Stack own;
  return own.holds(workspace.taken_at) && own.holds(now);
}

}  // namespace

// A call of the space, by one thread at a time. Queries of a space in which nothing changes may run
// beside another thread's call: as guests, which change nothing, not even the lock.
class ParallelSAPSpace::Use {
 public:
  enum Of { change, query };

  // With `locks` of 1 the contents are locked against changes until it is left in whatever way.
  explicit Use(ParallelSAPSpace& space, Of of = change, int locks = 0)
      : space_(space), locks_(locks) {
    const std::thread::id self = std::this_thread::get_id();
    std::thread::id user;
    if (is_sure || of == query
            ? !space.user_.compare_exchange_strong(user, self, std::memory_order_acquire)
            : (user = space.user_.load(std::memory_order_relaxed)) != std::thread::id())
      meet(user == self, of);
    else if (!is_sure && of == change)
      space.user_.store(self, std::memory_order_relaxed);
    count(locks);
  }
  ~Use() {
    count(-locks_);
    if (!alone_) return;
    space_.is_checked_.store(false, std::memory_order_relaxed);
    space_.user_.store(std::thread::id(), std::memory_order_release);
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

  bool isGuest() const { return is_guest_; }

 protected:
  ParallelSAPSpace& space_;
  bool alone_ = true;  // it is within no other call of the space
  bool is_guest_ = false;

 private:
  const int locks_;

  void count(int locks) {
    if (is_guest_) return;
    space_.lock_count += locks;
    space_.calls_ += locks;
  }
#ifdef NDEBUG
  static constexpr bool is_sure = false;  // two that begin at the same moment may go unseen
#else
  static constexpr bool is_sure = true;
#endif
  // A thread is in the space, or left it by longjmp.
  __attribute__((noinline)) void meet(bool itself, Of of) {
    alone_ = false;
    if (itself || (of == query && becomeGuest())) return;
    space_.complainOfThreads();
    alone_ = true;
    space_.user_.store(std::this_thread::get_id(), std::memory_order_relaxed);
  }
  // Waits while the other thread's query brings geoms up to date, unless that leaves meanwhile.
  // False where it does neither. Reads no geom before that thread has found those that changed
  // silently.
  bool becomeGuest() {
    constexpr std::chrono::seconds most(10);  // fixed: longer than that takes
    for (const Clock::time_point begin = Clock::now(); Clock::now() - begin < most;
         std::this_thread::yield()) {
      std::thread::id nobody;
      if (space_.is_checked_.load(std::memory_order_acquire) &&
          !space_.needs_clean_.load(std::memory_order_acquire) && space_.silent_.areClean())
        return is_guest_ = true;
      if (space_.user_.compare_exchange_strong(nobody, std::this_thread::get_id()))
        return alone_ = true;
    }
    return false;
  }
};

// A call that calls back, and uses the workspace of its depth. A callback may leave it by longjmp,
// which runs no destructor: the lock stays counted, and the thread in the space. So a call owns
// nothing, and the next call finds out whether that one has ended. A call at the same or a
// shallower depth of the same stack proves it. A deeper call, or one on another stack of the
// thread, counts as one within a callback: its pairs are right, but it keeps nothing and reports no
// events.
class ParallelSAPSpace::Call : public Use {
 public:
  Call(ParallelSAPSpace& space, Of of) : Call(space, of, this + 1) {}
  __attribute__((always_inline)) ~Call() {
    if (workspace_) workspace_->taken_at = nullptr;
  }

  // Null without memory for one within a callback, and for guests.
  Workspace* workspace() const { return workspace_; }
  // Those lists of it; null without memory.
  template <class Lists>
  Lists* lists(std::unique_ptr<Lists> Workspace::*lists) const {
    return workspace_ ? made(workspace_->*lists) : nullptr;
  }
  // Whether it is within a callback of this space.
  bool nested() const { return nested_; }

 protected:
  // The call's part of the stack goes on to `end`.
  __attribute__((always_inline)) Call(ParallelSAPSpace& space, Of of, void* end)
      : Use(space, of, 1), workspace_(is_guest_ ? nullptr : &space.workspace_) {
    if (alone_ && workspace_ && !workspace_->inner)
      workspace_->taken_at = reinterpret_cast<const char*>(this);
    else
      enter(end);
    if (is_guest_) return;
    alone_ = !nested_;
    if (alone_) space.edits_.clear();
  }

 private:
  __attribute__((noinline)) void enter(void* end) {
    Workspace* const outermost = workspace_;
    while (!alone_ && workspace_ && workspace_->taken_at &&
           !hasEnded(*workspace_, static_cast<const char*>(end))) {
      if (!workspace_->inner) workspace_->inner.reset(new (std::nothrow) Workspace);
      workspace_ = workspace_->inner.get();
    }
    nested_ = workspace_ != outermost;
    for (Workspace* ended = workspace_; ended; ended = ended->inner.get())
      ended->taken_at = nullptr;
    if (workspace_) workspace_->taken_at = reinterpret_cast<const char*>(this);
  }

  Workspace* workspace_;
  bool nested_ = false;
};

// A call that the next one knows to have ended, should it be left by longjmp. Calls that one
// function makes begin at depths that differ by less than the span.
class ParallelSAPSpace::SpannedCall : public Call {
 public:
  __attribute__((always_inline)) SpannedCall(ParallelSAPSpace& space, Of of)
      : Call(space, of, span_ + sizeof span_) {}

 private:
  char span_[1024];
};

// Without a workspace it learns of no change.
inline Reports ParallelSAPSpace::reportsOf(const Call& call) {
  if (call.isGuest()) return {};
  const Reports reports(this, edits_, slots_.geoms());
  if (!call.workspace()) edits_.noteChange();
  return reports;
}

ParallelSAPSpace::ParallelSAPSpace(dSpaceID parent, int space_class)
    : dxSpace(parent), pipeline_(settingsFromEnvironment()) {
  type = space_class;
  const auto reportThreadShortage = [](int granted, int wanted) {
    dMessage(0,
             "parallel SAP space: the machine provides %d of %d threads (limits of processes or of "
             "memory), and the work goes on with these",
             granted, wanted);
  };
  on_thread_shortage.store(reportThreadShortage, std::memory_order_relaxed);
}

ParallelSAPSpace::~ParallelSAPSpace() {
  require(!isLocked(), "Invalid operation for locked space", "dSpaceDestroy");
  {
    const SpaceObservers last = std::move(pipeline_.observers);  // print before those of sub-spaces
  }
  // The base class's destructor would not reach remove() any more.
  while (first) {
    if (cleanup)
      dGeomDestroy(first);
    else
      remove(first);
  }
}

// ODE's own function goes through the list, unless the geom after the last one is wanted.
dxGeom* ParallelSAPSpace::getGeom(int index) {
  const bool by_slot = index >= 0 && index < count && slots_.size() == std::size_t(count);
  return by_slot ? slots_.geoms()[index] : dxSpace::getGeom(index);
}

void ParallelSAPSpace::add(dxGeom* geom) {
  const Use use(*this);
  requireOpen("dSpaceAdd");
  dAASSERT(geom);
  require(geom->parent_space == 0, "geom is already in a space", "dSpaceAdd");
  require(!slots_.full(), "too many geoms in a parallel SAP space", "dSpaceAdd");

  if (!isLocked()) closeSlots();
  // All that may throw comes before the geom is known here.
  const Edits::Announced announced(this);
  const Slot slot = slots_.next();
  pipeline_.noteChange(slot);
  silent_.growTo(slot + std::size_t{1});
  slots_.add(geom, tail_);
  silent_.add(slot);
  noteMayBeSilent(slot);
  if (const auto* const own = parallelSAPSpace(geom); own && own->ever_swept_) noteSwept();
  noteMember();
  geom->next = nullptr;
  *tail_ = geom;
  tail_ = &geom->next;
  geom->parent_space = this;
  ++count;
  noteAround([geom](Edits& edits, const Edits::Geoms& geoms, Slot within) {
    edits.noteCame(geoms, within, geom);
  });

  // A geom that comes clean from elsewhere is new here all the same.
  geom->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
  dirty(geom);
  dGeomMoved(this);
}

void ParallelSAPSpace::remove(dxGeom* geom) {
  const Use use(*this);
  dAASSERT(geom);
  // ~dxGeom has made it one of the base class, and calls dSpaceRemove.
  const bool destroys = typeid(*geom) == typeid(dxGeom);
  const char* const function = destroys ? "dGeomDestroy" : "dSpaceRemove";
  requireOpen(function, destroys);
  require(geom->parent_space == this, "object is not in this space", function);

  const Edits::Announced announced(this);
  noteAround([geom](Edits& edits, const Edits::Geoms& geoms, Slot within) {
    edits.noteLeaving(geoms, within, geom);
  });
  const Slot slot = Slots::slotOf(geom);
  noteChange(slot);
  pipeline_.noteDeparture(geom, slot);
  if (silent_.remove(slot)) noteMayBeSilent(slot);
  geom->gflags &= ~told_dirty;
  pipeline_.observers.forEach([=](SpaceObserver& observer) { observer.forget(geom); });
  noteMember();
  swept_.remove(geom, slot);
  if (!geom->next) tail_ = slots_.tomeOf(geom);
  slots_.remove(geom, isLocked(), [&] { dxSpace::remove(geom); });
}

// A geom came or leaves. Running reports learn of that.
void ParallelSAPSpace::noteMember() {
  edits_.noteChange();
  for (Workspace* each = &workspace_; each; each = each->inner.get())
    if (each->frame.large) each->frame.large->limit = nullptr;
}

// Calls note(edits, geoms, slot) for the spaces of ours around this one of which calls run: the
// slot is that of this one, or of the sub-space that it is in.
template <class Note>
void ParallelSAPSpace::noteAround(Note note) {
  const dxGeom* within = this;
  for (dxSpace* around = parent_space; around; around = around->parent_space) {
    ParallelSAPSpace* const own = parallelSAPSpace(around);
    if (own && own->isLocked()) note(own->edits_, own->slots_.geoms(), Slots::slotOf(within));
    within = around;
  }
}

// Callbacks may destroy geoms with every ODE. One with assertions forbids all other changes, as it
// would if it saw the space locked.
void ParallelSAPSpace::requireOpen(const char* function, bool destroys) const {
  require(lock_count == 0 && (destroys || !isLocked() || !odeAsserts()),
          "Invalid operation for locked space", function);
}

void ParallelSAPSpace::dirty(dxGeom* geom) {
  const std::thread::id user = user_.load(std::memory_order_relaxed);
  if (__builtin_expect(user != std::thread::id(), 0) && user != std::this_thread::get_id())
    complainOfThreads();
  needs_clean_.store(true, std::memory_order_relaxed);
  geom->gflags |= told_dirty;
  const Slot slot = Slots::slotOf(geom);
  if (IS_SPACE(geom) && !parallelSAPSpace(geom)) {
    noteMayBeSilent(slot);
    // Only the first change of a stock space while callbacks run is sure to come here.
    if (isReporting()) edits_.noteWithin(slots_.geoms(), slot);
    noteAround([](Edits& edits, const Edits::Geoms& geoms, Slot within) {
      edits.noteWithin(geoms, within);
    });
  }
  noteChange(slot);
  if (isReporting() && !IS_SPACE(geom))
    require(!odeAsserts(), "a geom of a locked space moves or changes, as", "dGeomSetPosition");
}

// To the spaces of ours around this one, too.
void ParallelSAPSpace::noteMayBeSilent(Slot slot) {
  for (ParallelSAPSpace* space = this; space && space->silent_.noteChange(slot);) {
    slot = Slots::slotOf(space);
    space = parallelSAPSpace(space->parent_space);
  }
}

__attribute__((noinline)) void ParallelSAPSpace::complainOfThreads() {
#ifndef NDEBUG
  dDebug(d_ERR_UASSERT, "parallel SAP space %p: two threads use it at the same time",
         static_cast<const void*>(this));
#else
  pipeline_.complaints.ofThreads(this);
#endif
}

// The one place from which all that is kept learns that the geom of a slot is another or elsewhere.
void ParallelSAPSpace::noteChange(Slot slot) {
  if (GeomTree* const tree = tree_.get()) tree->changed(slot);
  pipeline_.noteChange(slot);
}

void ParallelSAPSpace::closeSlots() {
  if (!slots_.worthClosing(count)) return;
  pipeline_.closeSlots(slots_.geoms());
  swept_.closeSlots(slots_.geoms());
  slots_.close();
  if (GeomTree* const tree = tree_.get()) tree->reset();
  silent_.renumber(slots_.geoms());
}

void ParallelSAPSpace::setSweptBounds(dReal step) {
  if (step > 0) {
    noteSwept();
    any_swept.store(true, std::memory_order_relaxed);
  }
  swept_.setStep(step);
}

// For the spaces of ours around this one, too.
void ParallelSAPSpace::noteSwept() {
  for (ParallelSAPSpace* space = this; space && !space->ever_swept_;
       space = parallelSAPSpace(space->parent_space))
    space->ever_swept_ = true;
}

// Sub-spaces of ours come first: their AABBs are those of what is in them. dGeomMoved is not
// called, since a stock space around this one may be going through its list. So the box of this
// space is computed here at once, and a space of ours around it reads that box in each frame.
void ParallelSAPSpace::updateSweptBounds() {
  bool any = false;
  silent_.slots().forEach([&](Slot slot) {
    ParallelSAPSpace* const own = parallelSAPSpace(slots_.geoms()[slot]);
    if (!own || !own->ever_swept_) return;
    own->cleanGeoms();
    own->gflags |= GEOM_DIRTY | GEOM_AABB_BAD;
    dirty(own);
    any = true;
  });
  if (!swept_.idle()) {
    const Use lock(*this, Use::query, /*locks=*/1);
    if (!lock.isGuest() && swept_.update(*this, slots_.geoms().data(), slots_.size())) any = true;
  }
  if (!any) return;
  gflags |= GEOM_AABB_BAD;
  if (parent_space)
    recomputeAABB();
  else
    gflags |= GEOM_DIRTY;
}

bool ParallelSAPSpace::addMeshes(Slot slot, std::vector<SilentGeoms::Within>& meshes) {
  const Use use(*this, Use::query);
  silent_.listMeshes(slots_.geoms().data());
  return silent_.addMeshes(slot, meshes);
}

void ParallelSAPSpace::cleanGeoms() {
  const Use lock(*this, Use::query, /*locks=*/1);
  if (!lock.isGuest()) cleanAll();
}

// Where few geoms changed since the last query these are known.
void ParallelSAPSpace::cleanAll() {
  // Other threads may query the sub-spaces.
  if (needs_clean_.load(std::memory_order_relaxed)) silent_.cleanWithin(slots_.geoms().data());
  checkSilent();
  if (!needs_clean_) return;
  any_moved_ = true;
  const Scene all = scene(/*nested=*/true);
  if (GeomTree* const tree = tree_.get(); tree && tree->clean(slots_.geoms()))
    all.noteClean();
  else
    pipeline_.clean(all);
}

// Within a callback of this space the slots stay what they are, and what is held stays held.
void ParallelSAPSpace::beginFrame(const Call& call) {
  GeomTree* const tree = tree_.get();
  if (!call.nested()) {
    const int part = memory_watch_.noteFrame(count, last_pairs_);
    static_assert(MemoryWatch::parts == Pipeline::parts + 1, "the last part is the space's own");
    if (part == Pipeline::parts) {
      call.workspace()->releaseQueries();
      call.workspace()->inner.reset();
      if (tree) tree->release();
      slots_.shrink();
      swept_.shrink();
    } else if (part != MemoryWatch::none) {
      pipeline_.release(part, call.workspace()->frame);
    }
    closeSlots();
    if (tree && tree->noteFrame()) call.workspace()->releaseQueries();
  }
  const unsigned notified = notify_all_calls.load(std::memory_order_relaxed);
  if (notified != notify_all_calls_seen_) pipeline_.notify(nullptr);
  notify_all_calls_seen_ = notified;
  checkSilent();
  if (needs_clean_) any_moved_ = true;
  pipeline_.observers.forEach([&](SpaceObserver& observer) {
    if (call.nested() || !observer.wantsScene()) return;
    const Scene all = scene(/*nested=*/false);
    if (needs_clean_) pipeline_.clean(all);
    observer.seeScene(all, pipeline_.settings.rules);
  });
}

inline GeomTree* ParallelSAPSpace::treeOf(const Use& use) {
  return use.isGuest() ? tree_.get() : tree_.made();
}

// Without a part of its own a call has another one. That is on the stack of no other call: a
// callback may need that.
template <class Part, class Run>
auto ParallelSAPSpace::with(Part* own, Run run) {
  const auto withOther = [&]() __attribute__((noinline)) {
    Part other;
    return run(other);
  };
  return own ? run(*own) : withOther();
}

void ParallelSAPSpace::notifyAll() {
  notify_all_calls.fetch_add(1, std::memory_order_relaxed);
}

template <class Collide>
void ParallelSAPSpace::runFrame(Collide collide) {
  const SpannedCall call(*this, Use::change);
  beginFrame(call);
  if constexpr (validates) {
    slots_.validate(first, std::size_t(count));
    silent_.validate(slots_.geoms());
  }
  std::optional<FrameLists> own;  // without memory for a workspace
  FrameLists& lists = call.workspace() ? call.workspace()->frame : own.emplace();
  last_pairs_ =
      collide({scene(call.nested(), reportsOf(call)), lists, tree_, getManualCleanup() != 0});
  if constexpr (validates) edits_.validate(slots_.geoms());
  if (call.nested()) return;
  pipeline_.observers.forEach(
      [&](SpaceObserver& observer) { observer.endFrame(this, any_moved_); });
  any_moved_ = false;
}

void ParallelSAPSpace::collide(void* data, dNearCallback* callback) {
  dAASSERT(callback);
  runFrame([&](const FrameCall& frame) { return pipeline_.collide(frame, data, callback); });
}

void ParallelSAPSpace::collideContacts(const ContactRequest& request) {
  runFrame([&](const FrameCall& frame) {
    return with(made(frame.lists.large), [&](LargeLists& lists) {
      return pipeline_.collideContacts(frame, request, lists);
    });
  });
}

void ParallelSAPSpace::collidePairs(const PairsRequest& request) {
  runFrame([&](const FrameCall& frame) { return pipeline_.collidePairs(frame, request); });
}

// Brings the geom of a query up to date, as a call of the space that it is in: another thread may
// be doing that. It may wait for that thread, so this space is up to date before. Else the threads
// of two spaces could wait for each other.
inline void ParallelSAPSpace::updateProbe(dxGeom* geom) {
  if (IS_SPACE(geom)) {
    if (ParallelSAPSpace* const own = parallelSAPSpace(geom)) own->cleanGeoms();
  } else if (any_swept.load(std::memory_order_relaxed)) {
    ParallelSAPSpace* const own = parallelSAPSpace(geom->parent_space);
    if (own && !own->swept_.idle()) {
      const Use lock(*own, Use::query, /*locks=*/1);
      if (!lock.isGuest()) own->swept_.updateOne(geom, Slots::slotOf(geom), own->slots_.size());
    }
  }
  dxSpace* around = geom->parent_space;
  while (around && !parallelSAPSpace(around)) around = around->parent_space;
  std::optional<Use> use;
  if (around && around != this) use.emplace(*parallelSAPSpace(around), Use::query);
  updateAABB(geom);
}

// Once something has changed, only hits that have not left, while the geom of the query has not.
// Not inline, as is all that a callback need not have above it on the stack.
__attribute__((noinline)) void ParallelSAPSpace::reportMany(const Call& call, dxGeom* geom,
                                                            void* data, dNearCallback* callback) {
  with(call.lists(&Workspace::query), [&](QueryLists& lists) {
    const Reports reports = reportsOf(call);
    if (!findHits(call, geom, lists))
      return queryWithoutMemory(scene(/*nested=*/true, reports), pipeline_.settings.rules, geom,
                                data, callback);
    const Buffer<dxGeom*>& geoms = slots_.geoms();
    const bool within = geom->parent_space == this;
    const Slot probe = within ? Slots::slotOf(geom) : 0;
    const Reports::Open open(reports);
    for (std::size_t hit = 0; hit < lists.hits.size(); ++hit)
      if (!reports.changed() || (geoms[lists.found[hit]] && !(within && !geoms[probe])))
        callback(data, lists.hits[hit], geom);
  });
}

// The same of few geoms, which needs no lists.
__attribute__((always_inline)) inline void ParallelSAPSpace::reportFew(const Call& call,
                                                                       dxGeom* geom, void* data,
                                                                       dNearCallback* callback) {
  const Buffer<dxGeom*>& geoms = slots_.geoms();
  std::uint32_t hits = findFew(geoms, geom, pipeline_.settings.rules);
  if (!hits) return;
  for (std::uint32_t rest = hits; rest; rest &= rest - 1)
    if (!passesAABBTests(geoms[__builtin_ctz(rest)], geom)) hits &= ~(rest & -rest);
  const bool within = geom->parent_space == this;
  const Slot probe = within ? Slots::slotOf(geom) : 0;
  const Reports::Open open(reportsOf(call));
  for (; hits && !(within && !geoms[probe]); hits &= hits - 1)
    if (dxGeom* const own = geoms[__builtin_ctz(hits)]) callback(data, own, geom);
}

void ParallelSAPSpace::collide2(void* data, dxGeom* geom, dNearCallback* callback) {
  dAASSERT(geom && callback);
  const Call call(*this, Use::query);
  const bool timed = pipeline_.statistics.timesQueries();
  const Clock::time_point begin = timed ? Clock::now() : Clock::time_point();
  const Statistics::QueryBy by = !timed || parent_space || IS_SPACE(geom) ? Statistics::other
                                 : geom->type == dRayClass                ? Statistics::ray
                                                                          : Statistics::geom;
  if (!call.isGuest()) cleanAll();
  updateProbe(geom);
  const bool is_empty = IS_SPACE(geom) && isEmpty(static_cast<dxSpace*>(geom));
  if (!is_empty && hasNaN(geom))
    pipeline_.complaints.ofInvalid(geom);
  else if (!is_empty && slots_.size() <= few_geoms)
    reportFew(call, geom, data, callback);
  else if (!is_empty)
    reportMany(call, geom, data, callback);
  if (timed) pipeline_.statistics.noteQuery(by, milliseconds(begin, Clock::now()));
}

// By the tree where queries come often enough. False without memory. Not inline either.
__attribute__((noinline)) bool ParallelSAPSpace::findHits(const Use& use, dxGeom* geom,
                                                          QueryLists& lists) {
  try {
    with(treeOf(use), [&](GeomTree& tree) {
      const ScopedMode mode(exactMode());
      std::optional<GeomTree::Reader> guest;
      if (use.isGuest()) guest.emplace(tree);
      const Buffer<dxGeom*>& geoms = slots_.geoms();
      const bool may_read =
          guest ? guest->mayRead()
                : tree.bringUpToDate(geoms, Policy::teamFor(geoms.size(), pipeline_.settings));
      ode_parallel_sap::findHits(may_read ? &tree : nullptr, geoms, geom, pipeline_.settings.rules,
                                 lists);
    });
    lists.found.resizeDiscarding(lists.hits.size());
  } catch (const std::bad_alloc&) {
    if (GeomTree* const tree = tree_.get(); tree && !use.isGuest()) tree->release();
    return false;
  }
  Buffer<dxGeom*>& hits = lists.hits;
  std::size_t passed = 0;
  for (dxGeom* const own : hits) {
    if (!passesAABBTests(own, geom)) continue;
    lists.found[passed] = Slots::slotOf(own);
    hits[passed++] = own;
  }
  hits.resize(passed);
  return true;
}

// Of its large sub-spaces, where these are no more than the queries. A batch that another thread
// casts meanwhile may read the trees, too.
NestedTrees ParallelSAPSpace::nestedTrees(std::size_t queries) const {
  NestedTrees nested;
  silent_.forLarge(queries, [&](ParallelSAPSpace& own) {
    if (own.needs_clean_ || own.silent_.mayHoldSpaces()) return;
    const Use use(own, Use::query);
    GeomTree* const tree = own.treeOf(use);
    if (!tree) return;
    const Buffer<dxGeom*>& geoms = own.slots_.geoms();
    try {
      if (!use.isGuest())
        tree->bringUpToDate(geoms, Policy::teamFor(geoms.size(), own.pipeline_.settings), queries);
      const GeomTree::Reader reader(*tree);
      if (reader.mayRead()) nested.push_back({Slots::slotOf(&own), *tree, geoms, reader});
    } catch (const std::bad_alloc&) {
      if (!use.isGuest()) tree->release();
    }
  });
  return nested;
}

// Calls find(scene, tree, request, way, lists, nested) for a batch of queries, and note(count, ms).
template <class Request, class Lists, class Find>
std::size_t ParallelSAPSpace::runBatch(const Request& request,
                                       std::unique_ptr<Lists> Workspace::*own, Find find,
                                       void (Statistics::*note)(std::size_t, double)) {
  const Clock::time_point begin = Clock::now();
  const SpannedCall call(*this, Use::query);
  if (!call.isGuest()) cleanAll();
  const BatchWay way = {call.isGuest() ? 1 : threadsFor(pipeline_.settings),
                        getManualCleanup() != 0, call.isGuest(), query_filter_,
                        pipeline_.settings.rules};
  const Scene all = scene(/*nested=*/true, reportsOf(call));
  const std::size_t found = with(treeOf(call), [&](GeomTree& tree) {
    return with(call.lists(own), [&](Lists& lists) {
      return find(all, tree, request, way, lists, nestedTrees(request.count));
    });
  });
  (pipeline_.statistics.*note)(request.count, milliseconds(begin, Clock::now()));
  return found;
}

std::size_t ParallelSAPSpace::castRays(const RayRequest& request) {
  return runBatch(request, &Workspace::rays, ode_parallel_sap::castRays, &Statistics::noteRays);
}

std::size_t ParallelSAPSpace::findOverlaps(OverlapRequest request) {
  request.swept = any_swept.load(std::memory_order_relaxed);
  request.prepare = [this](dxGeom* geom) {
    require(geom && !IS_SPACE(geom), "a probe is a geom, no space", "dParallelSAPSpaceOverlaps");
    updateProbe(geom);
    if (hasNaN(geom)) pipeline_.complaints.ofInvalid(geom);
  };
  return runBatch(request, &Workspace::overlaps, ode_parallel_sap::findOverlaps,
                  &Statistics::noteOverlaps);
}

dParallelSAPStats ParallelSAPSpace::stats() {
  return pipeline_.statistics.onRequest(
      sizeof *this + bytesOf(slots_, silent_, swept_, tree_, pipeline_, workspace_));
}

// Mostly of the class that it was the last time, which is compared at once.
ParallelSAPSpace* parallelSAPSpace(dxGeom* geom) {
  static std::atomic<const std::type_info*> last{&typeid(ParallelSAPSpace)};
  if (!geom || !IS_SPACE(geom)) return nullptr;
  if (&typeid(*geom) == last.load(std::memory_order_relaxed))
    return static_cast<ParallelSAPSpace*>(geom);
  ParallelSAPSpace* const own = dynamic_cast<ParallelSAPSpace*>(geom);
  if (own) last.store(&typeid(*own), std::memory_order_relaxed);
  return own;
}

}  // namespace ode_parallel_sap
