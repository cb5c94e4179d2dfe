// Scenes so small that they need no boxes. Sees ODE's private headers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "space/coherence/pair_events.h"
#include "space/data/tuning.h"
#include "space/frame/complaints.h"
#include "space/frame/statistics.h"
#include "space/geom/geom_tests.h"
#include "space/geom/pack_rules.h"
#include "space/geom/scene.h"

namespace ode_parallel_sap {

// The geoms of such a scene that take part, and what was found among them.
struct SmallScene {
  // Places in `active`; read as they are written, in one word.
  struct IndexPair {
    std::uint16_t places;
    unsigned earlier() const { return places >> 8; }
    unsigned later() const { return places & 0xff; }
  };
  dxGeom* active[smallest_scene];
  IndexPair index_pairs[smallest_scene * (smallest_scene - 1) / 2];
  unsigned actives = 0, invalid = 0, unbounded = 0;
  bool user_classes = false;
  bool recalled = false;  // what was found is what was remembered
  std::size_t moved = 0, candidates = 0, pairs = 0;

  SmallResult result(std::size_t geoms) const {
    return {geoms, moved, geoms - actives - invalid, invalid, unbounded, candidates, pairs};
  }
};

// Who is told of the pairs of a small scene.
struct SmallReport {
  void* data;
  dNearCallback* callback;
  void (*end)(void* data) = nullptr;  // called after the last one; may be 0
  PairEvents* events = nullptr;       // told which pairs there are; may be 0
  bool sampled = true;                // pairs are picked from those that are reported
};

// A small scene in which nothing moves: the candidates of its pairs stay while no geom is dirty,
// and all are as they were in what a geom does not tell its space.
class StillScene {
 public:
  // Whether the rules and all geoms of a space, from the first in its list on, are as remembered.
  bool holds(const dxGeom* first, const PackRules& rules) const {
    if (rules != rules_) return false;
    const Seen* seen = seen_.data();
    const Seen* const end = seen + seen_.size();
    for (const dxGeom* geom = first; geom; geom = geom->next, ++seen)
      if (seen == end || !seen->is(geom)) return false;
    return seen == end;
  }
  void remember(const dxGeom* first, const PackRules& rules, const SmallScene& scene) {
    rules_ = rules;
    seen_.clear();
    for (const dxGeom* geom = first; geom; geom = geom->next)
      seen_.push_back({geom, geom->body, geom->category_bits, geom->collide_bits, isEnabled(geom)});
    active_.assign(scene.active, scene.active + scene.actives);
    index_pairs_.assign(scene.index_pairs, scene.index_pairs + scene.candidates);
    invalid_ = scene.invalid;
    unbounded_ = scene.unbounded;
    user_classes_ = scene.user_classes;
  }
  void recall(SmallScene& scene) const {
    std::copy(active_.begin(), active_.end(), scene.active);
    std::copy(index_pairs_.begin(), index_pairs_.end(), scene.index_pairs);
    scene.actives = static_cast<unsigned>(active_.size());
    scene.candidates = index_pairs_.size();
    scene.invalid = invalid_;
    scene.unbounded = unbounded_;
    scene.user_classes = user_classes_;
    scene.recalled = true;
  }
  std::size_t bytes() const {
    return sizeof *this + seen_.capacity() * sizeof(Seen) + active_.capacity() * sizeof(dxGeom*) +
           index_pairs_.capacity() * sizeof(SmallScene::IndexPair);
  }

 private:
  struct Seen {
    const dxGeom* geom;
    const dxBody* body;
    unsigned long category, collide;
    bool enabled;

    bool is(const dxGeom* now) const {
      return now == geom && !(now->gflags & GEOM_DIRTY) && now->body == body &&
             now->category_bits == category && now->collide_bits == collide &&
             isEnabled(now) == enabled;
    }
  };

  PackRules rules_;
  std::vector<Seen> seen_;
  std::vector<dxGeom*> active_;
  std::vector<SmallScene::IndexPair> index_pairs_;
  unsigned invalid_ = 0, unbounded_ = 0;
  bool user_classes_ = false;
};

// The same promises as the pipeline's without boxes, lists or clocks: for so few geoms those would
// take most of the time. Once nothing has moved for two frames the pairs are remembered.
class SmallScenes {
 public:
  // A geom became dirty, came or went.
  void noteChange() { is_still_ = false; }
  SmallResult collide(const Scene& scene, const PackRules& rules, Complaints& complaints,
                      Statistics& statistics, const SmallReport& report);
  std::size_t bytes() const {
    return (still_scene_ ? still_scene_->bytes() : 0) + event_pairs_.bytes();
  }

 private:
  void remember(const Scene& scene, const PackRules& rules, const SmallScene& found);
  bool tell(const Scene& scene, const SmallScene& found, PairEvents& events);
  static std::size_t reportSampled(const SmallScene& found, const SmallReport& report,
                                   PairSample& sample);

  std::unique_ptr<StillScene> still_scene_;
  bool is_still_ = false;      // it was remembered, and noteChange() was not called since
  unsigned still_frames_ = 0;  // without a move, in a row
  PairList event_pairs_;       // by slot
};

}  // namespace ode_parallel_sap
