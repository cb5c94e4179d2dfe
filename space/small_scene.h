// Scenes so small that they need no boxes. Sees ODE's private headers.
#ifndef ODE_PARALLEL_SAP_SMALL_SCENE_H
#define ODE_PARALLEL_SAP_SMALL_SCENE_H

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "geom_tests.h"
#include "ode_private.h"
#include "pack_rules.h"

namespace ode_parallel_sap {

// Up to this number of slots a scene is collided pair by pair on the spot.
constexpr std::size_t smallest_scene = 40;

// The geoms of such a scene that take part, and what was found among them.
struct SmallScene {
  // Places in `active`; read as they are written, in one word.
  struct Couple {
    std::uint16_t places;
    unsigned earlier() const { return places >> 8; }
    unsigned later() const { return places & 0xff; }
  };
  dxGeom* active[smallest_scene];
  Couple couples[smallest_scene * (smallest_scene - 1) / 2];
  unsigned actives = 0, invalid = 0, unbounded = 0;
  bool user_classes = false;
  std::size_t moved = 0, candidates = 0, pairs = 0;
};

// A small scene in which nothing moves: the candidates of its pairs stay while no geom is dirty,
// and all are as they were in what a geom does not tell its space.
class StillScene {
 public:
  // Whether the rules and all geoms of a space, from the first in its list on, are as remembered.
  bool holds(const dxGeom* first, const PackRules& rules) const {
    if (rules != rules_) return false;
    const Seen* seen = seen_;
    const Seen* const end = seen_ + count_;
    for (const dxGeom* geom = first; geom; geom = geom->next, ++seen)
      if (seen == end || !seen->is(geom)) return false;
    return seen == end;
  }
  void remember(const dxGeom* first, const PackRules& rules, const SmallScene& scene) {
    rules_ = rules;
    count_ = 0;
    for (const dxGeom* geom = first; geom; geom = geom->next)
      seen_[count_++] = {geom, geom->body, geom->category_bits, geom->collide_bits,
                         isEnabled(geom)};
    copy(scene, scene_);
  }
  void recall(SmallScene& scene) const { copy(scene_, scene); }

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
  static void copy(const SmallScene& from, SmallScene& to) {
    std::copy(from.active, from.active + from.actives, to.active);
    std::copy(from.couples, from.couples + from.candidates, to.couples);
    to.actives = from.actives;
    to.invalid = from.invalid;
    to.unbounded = from.unbounded;
    to.user_classes = from.user_classes;
    to.candidates = from.candidates;
  }

  PackRules rules_;
  std::size_t count_ = 0;
  Seen seen_[smallest_scene];
  SmallScene scene_;
};

}  // namespace ode_parallel_sap

#endif
