// The dSpace itself: ODE's side of it (parallel_sap_space.cpp), the pipeline (collide.cpp) and the
// smallest scenes (small_scene.cpp). Sees ODE's private headers.
#ifndef ODE_PARALLEL_SAP_PARALLEL_SAP_SPACE_IMPL_H
#define ODE_PARALLEL_SAP_PARALLEL_SAP_SPACE_IMPL_H

#include <ode_parallel_sap/parallel_sap_space.h>

#include <memory>
#include <unordered_set>
#include <vector>

#include "space/coherence/pair_keeper.h"
#include "space/contacts/contact_pairs.h"
#include "space/contacts/narrow_phase.h"
#include "space/data/box_set.h"
#include "space/data/buffer.h"
#include "space/data/pair_list.h"
#include "space/extract/cpu_finders.h"
#include "space/extract/device_backend.h"
#include "space/filter/pair_filter.h"
#include "space/filter/plane_pairs.h"
#include "space/frame/frame_sums.h"
#include "space/frame/memory_watch.h"
#include "space/frame/method_choice.h"
#include "space/frame/small_scene.h"
#include "space/frame/team_choice.h"
#include "space/geom/ode_private.h"
#include "space/ode/settings.h"
#include "space/ode/silent_geoms.h"
#include "space/queries/geom_queries.h"
#include "space/update/geom_update.h"

namespace ode_parallel_sap {

// Geoms sit in slots in the order in which they were added; a removed one leaves its slot empty
// until the slots are closed up. A geom knows its slot: slot + 1 is kept in dxGeom::tome_ex, a
// field that ODE leaves to spaces for this.
//
// The linked list of the base class holds the geoms in the same order, for ODE's own functions that
// walk it. Its stock form, dirty geoms first, is needed by the stock spaces' cleanGeoms only: here
// dirty geoms are found by their flags while the slots are read, and dSpaceCollide2 of two spaces
// walks in the order of the report.
class ParallelSAPSpace : public dxSpace {
 public:
  // IS_SPACE is a range check on the type, so it must be one of ODE's. No function of ODE casts on
  // the default.
  explicit ParallelSAPSpace(dSpaceID parent, int space_class = dSweepAndPruneSpaceClass);
  ~ParallelSAPSpace();

  void add(dxGeom* geom) override;
  void remove(dxGeom* geom) override;
  void dirty(dxGeom* geom) override;
  void cleanGeoms() override;
  void collide(void* data, dNearCallback* callback) override;
  void collide2(void* data, dxGeom* geom, dNearCallback* callback) override;
  void collideContacts(const ContactRequest& request);
  // Adds all meshes in it, at any depth.
  void addMeshes(std::vector<dxGeom*>& meshes);

  Settings settings;
  // Also asks for times from now on, which the smallest scenes do without.
  const dParallelSAPStats& stats();

 protected:
  // The sums of all frames, if settings.print_stats.
  const FrameSums& totals() const { return totals_; }
  // Whether it prints them itself at its end.
  bool prints_totals_ = true;

 private:
  class Lock;
  class Frame;
  class StageClock;

  void closeSlots();
  void noteSilent();
  void cleanNoted();
  std::size_t cleanOneByOne();
  void beginFrame();
  void releaseSpareMemory();
  int threadsForScene() const;
  int threadsForFrame() const;
  bool isSmallest() const;
  bool timesSmallest();
  void collideSmallest(void* data, dNearCallback* callback);
  void findSmallest(SmallScene& scene);
  bool isStill() const;
  void rememberStill(const SmallScene& scene);
  static void testSmallest(SmallScene& scene);
  void noteSmallest(const SmallScene& scene);
  bool findPairs(PairList& pairs, int threads, StageClock& clock);
  void collectPairs(ContactPairs& pairs, StageClock& clock);
  bool collideCollected(const Buffer<GeomPair>& pairs, const ContactRequest& request,
                        NarrowPhase& narrow_phase, dParallelSAPStats& stats);
  bool mayKeep() const;
  bool findChanges(PairList& pairs, StageClock& clock);
  void findAll(PairList& pairs, StageClock& clock);
  void selectPairs(PairList& pairs);
  void update();
  void synchronise();
  void noteFacts();
  CPUFinders& finders();
  int fastestMethod();
  void extract(PairList& pairs);
  void extractBy(int method, PairList& pairs);
  void extractWhereFastest(int method, PairList& pairs);
  void countDevices(int devices);
  void extractOnProcessor(int method, PairList& pairs);
  bool extractCrowd(PairList& pairs);
  bool pairsExactly(dxGeom* a, dxGeom* b) const;
  bool isCulled(dxGeom* a, dxGeom* b) const;
  void report(const PairList& pairs, void* data, dNearCallback* callback);
  void collideWithoutMemory(void* data, dNearCallback* callback);
  void collide2WithoutMemory(void* data, dxGeom* geom, dNearCallback* callback);
  void reportInvalid(const dxGeom* geom);
  void reportTooLong(const ListsTooLong& lists);
  void countTotals();
  void printTotals() const;
  std::size_t memoryBytes() const;

  Buffer<dxGeom*> geoms_;  // by slot
  dxGeom** tail_ = &first;
  bool needs_clean_ = false;
  SilentGeoms silent_;
  std::unordered_set<const dxGeom*> reported_invalid_;

  TeamChoice team_choice_;
  int frame_threads_ = 1;
  GeomQueries queries_;
  Buffer<dxGeom*> hits_;  // of a query
  GeomUpdate geom_update_;
  BoxSet boxes_;
  std::unique_ptr<CPUFinders> cpu_finders_;
  MethodChoice method_choice_;
  DeviceBackend device_;
  PairFilter pair_filter_;
  PlanePairs plane_pairs_;
  PairKeeper pair_keeper_;
  PackRules rules_;  // of the frame
  PairList pairs_;   // reported in the last frame
  // Where these are not all that may have to be reported in the next one: those.
  PairList kept_;
  bool kept_apart_ = false;
  PairList others_;  // than those of planes, where these are found apart
  Buffer<GeomPair> contact_pairs_;
  NarrowPhase narrow_phase_;
  TeamChoice narrow_team_choice_;
  const UpdateFacts* facts_ = nullptr;
  MemoryWatch memory_watch_;

  std::unique_ptr<StillScene> still_scene_;  // of the smallest scenes
  bool is_still_ = false;                    // it was remembered, and no geom became dirty since
  unsigned still_frames_ = 0;                // without a move, in a row

  bool timed_ = false;            // statistics are asked for
  unsigned smallest_frames_ = 0;  // since then
  bool stats_of_smallest_ = false;
  bool out_of_memory_reported_ = false;
  bool lists_too_long_reported_ = false;
  dParallelSAPStats stats_ = {};
  FrameSums totals_;
};

// The space behind an id, or null if it is not one of ours.
ParallelSAPSpace* parallelSAPSpace(dSpaceID space);

}  // namespace ode_parallel_sap

#endif
