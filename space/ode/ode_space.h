// The dSpace itself: what ODE sees of it.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "space/frame/frame.h"
#include "space/frame/policy.h"
#include "space/geoms/ode_private.h"
#include "space/geoms/scene.h"
#include "space/ode/silent_geoms.h"
#include "space/ode/swept_bounds.h"
#include "space/queries/geom_tree.h"
#include "space/rays/overlap_finder.h"
#include "space/rays/ray_caster.h"

namespace ode_parallel_sap {

// What a call of a space holds while it calls back, owned by the space.
struct Workspace {
  FrameLists frame;
  std::unique_ptr<QueryLists> query;
  std::unique_ptr<RayLists> rays;
  std::unique_ptr<OverlapLists> overlaps;
  const char* taken_at = nullptr;    // where the call that uses it stands on its stack
  std::unique_ptr<Workspace> inner;  // for a call within a callback of that call

  void releaseQueries() {
    query.reset();
    rays.reset();
    overlaps.reset();
  }
  std::size_t bytes() const { return bytesOf(frame, query, rays, overlaps, inner); }
};

// The linked list of the base class holds the geoms in the order of their slots, for ODE's own
// functions that walk it. Dirty geoms are found by their flags, and do not come first as in stock
// spaces.
class ParallelSAPSpace : public dxSpace {
 public:
  // IS_SPACE is a range check on the type, so it must be one of ODE's. No function of ODE casts on
  // the default.
  explicit ParallelSAPSpace(dSpaceID parent, int space_class = dSweepAndPruneSpaceClass);
  ~ParallelSAPSpace();

  dxGeom* getGeom(int index) override;
  void add(dxGeom* geom) override;
  void remove(dxGeom* geom) override;
  void dirty(dxGeom* geom) override;
  void cleanGeoms() override;
  void collide(void* data, dNearCallback* callback) override;
  void collide2(void* data, dxGeom* geom, dNearCallback* callback) override;
  void collideContacts(const ContactRequest& request);
  void collidePairs(const PairsRequest& request);
  std::size_t castRays(const RayRequest& request);
  std::size_t findOverlaps(OverlapRequest request);
  // Adds all meshes in it, at any depth, as those of a slot. Whether there are stock spaces in it.
  // Another thread may query it meanwhile. Throws std::bad_alloc.
  bool addMeshes(Slot slot, std::vector<SilentGeoms::Within>& meshes);

  // The program announces that any geom of any space may have other bits, another body or another
  // enabled state, as it does of one space by Pipeline::notify().
  static void notifyAll();

  // The AABBs of its geoms cover what they will move in such a time; 0: nothing.
  void setSweptBounds(dReal step);
  dReal sweptBounds() const { return swept_.step(); }
  // Whether the motion of a geom of it was a long one for its size when its AABB was made.
  bool isFast(const dxGeom* geom) const { return swept_.isFast(Slots::slotOf(geom)); }

  void setQueryFilter(const QueryFilter& filter) { query_filter_ = filter; }

  Pipeline& pipeline() { return pipeline_; }
  const Pipeline& pipeline() const { return pipeline_; }

  // Whether a call of it runs, or was left by longjmp.
  bool isLocked() const { return calls_ > 0; }

  Settings& settings() { return pipeline_.settings; }
  // Small scenes are timed from now on.
  dParallelSAPStats stats();

 protected:
  // Where dxHashSpace has its levels, at the beginning: ODE's dHashSpaceSetLevels writes there in
  // stand-ins of hash spaces, and without assertions in any space.
  int hash_levels_[2] = {-3, 10};

 private:
  class Use;
  class Call;
  class SpannedCall;

  // Of a call that begins now.
  Reports reportsOf(const Call& call);
  Scene scene(bool nested, const Reports& reports = {}) {
    return {first, std::size_t(count), slots_.geoms(), nested, needs_clean_, reports};
  }
  void beginFrame(const Call& call);
  template <class Part, class Run>
  static auto with(Part* own, Run run);
  // A guest makes nothing.
  inline GeomTree* treeOf(const Use& use);
  template <class Collide>
  void runFrame(Collide collide);
  template <class Request, class Lists, class Find>
  std::size_t runBatch(const Request& request, std::unique_ptr<Lists> Workspace::*own, Find find,
                       void (Statistics::*note)(std::size_t, double));
  void closeSlots();
  void noteMayBeSilent(Slot slot);
  void noteSwept();
  // Checks the geoms that may be dirty without having said so, before swept bounds make some dirty
  // of which spaces around this one are not to know.
  void checkSilent() {
    if (!silent_.areClean()) {
      is_checked_.store(false, std::memory_order_relaxed);
      silent_.check(*this, slots_.geoms().data());
    }
    if (ever_swept_) updateSweptBounds();
    is_checked_.store(true, std::memory_order_release);
  }
  inline void updateProbe(dxGeom* geom);
  void updateSweptBounds();
  void cleanAll();
  bool findHits(const Use& use, dxGeom* geom, QueryLists& lists);
  NestedTrees nestedTrees(std::size_t queries) const;
  void reportMany(const Call& call, dxGeom* geom, void* data, dNearCallback* callback);
  inline void reportFew(const Call& call, dxGeom* geom, void* data, dNearCallback* callback);
  void noteChange(Slot slot);
  void noteMember();
  bool isReporting() const { return calls_ > 0 && lock_count == 0; }
  template <class Note>
  void noteAround(Note note);
  void requireOpen(const char* function, bool destroys = false) const;
  void complainOfThreads();

  std::atomic<std::thread::id> user_{std::thread::id()};  // the thread that is in the space
  std::atomic<bool> is_checked_{false};                   // its call has found the silent changes
  Slots slots_;
  dxGeom** tail_ = &first;
  std::atomic<bool> needs_clean_{false};
  int calls_ = 0;  // that run: the last ones within callbacks of the others
  Edits edits_;
  unsigned notify_all_calls_seen_ = 0;  // how often that had been when it last collided
  SilentGeoms silent_;
  SweptBounds swept_;
  bool ever_swept_ = false;  // it, or a space of ours in it
  SharedPart<GeomTree> tree_;
  QueryFilter query_filter_;
  Pipeline pipeline_;
  MemoryWatch memory_watch_;
  std::size_t last_pairs_ = 0;  // of the last frame
  bool any_moved_ = false;      // since the last frame within no callback
  Workspace workspace_;
};

// The space that a geom, which may be null, is; null if it is none of ours.
ParallelSAPSpace* parallelSAPSpace(dxGeom* geom);

}  // namespace ode_parallel_sap
