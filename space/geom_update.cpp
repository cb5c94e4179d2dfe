#include "geom_update.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "floating_point.h"
#include "geom_tests.h"
#include "parallel.h"
#include "round_outward.h"

namespace ode_parallel_sap {

namespace {

// Geoms and bodies lie scattered in memory: their cache lines are asked for in blocks of this many,
// a geom's two blocks and its pose's one block before they are needed.
constexpr std::size_t block_size = 32;

bool hasGimpact() {
  static const bool has = dCheckConfiguration("ODE_EXT_gimpact") != 0;
  return has;
}

// Whether other threads may compute other geoms' AABBs at the same time: not where user code runs,
// where a sub-space cleans its geoms, or where geoms share caches.
bool needsCallingThread(const dxGeom* geom) {
  return IS_SPACE(geom) || isUserClass(geom) || geom->type == dGeomTransformClass ||
         (geom->type == dTriMeshClass && hasGimpact());
}

// Coarse boxes may all overlap each other: boxes become doubles once those pairs could be more than
// the boxes, and floats again when they would be far fewer.
bool needsDoubles(std::size_t coarse, std::size_t slots, bool wide) {
  return coarse * coarse / 2 > (wide ? slots / 4 : slots);
}

template <class Real>
constexpr BasicBox<Real> inactiveBox() {
  constexpr Real nan = std::numeric_limits<Real>::quiet_NaN();
  return {{nan, nan, nan}, {nan, nan, nan}};
}

void deactivate(Slot slot, BoxSet& boxes) {
  if (boxes.wide)
    boxes.wide_boxes[slot] = inactiveBox<double>();
  else
    boxes.boxes[slot] = inactiveBox<float>();
}

// All bits as 32: a match of the originals is always a match of these.
std::uint32_t foldBits(unsigned long bits, UpdateFacts& facts) {
  const std::uint64_t wide = bits;
  const std::uint32_t low = static_cast<std::uint32_t>(wide), high = wide >> 32;
  if (high != 0 && ~wide != 0) facts.exact_bits = false;
  return low | high;
}

// Bits 4 to 35 of an address tell bodies apart as long as their other bits are alike.
constexpr std::uintptr_t body_bits = std::uintptr_t{0xffffffff} << 4;

void packGeom(const dxGeom* geom, Slot slot, UpdateFacts& facts, std::uintptr_t& some_body,
              BoxSet& boxes) {
  if (!geom || !isEnabled(geom)) {
    facts.disabled += geom != nullptr;
    deactivate(slot, boxes);
    return;
  }
  Box box;
  const BoundsFacts bounds = roundOutward(geom->aabb, box);
  if (bounds.nan) {
    facts.invalid.push_back(slot);
    deactivate(slot, boxes);
    return;
  }
  if (boxes.wide) {
    BasicBox<double>& wide = boxes.wide_boxes[slot];
    for (int axis = 0; axis < 3; ++axis) {
      wide.lower[axis] = geom->aabb[2 * axis];
      wide.upper[axis] = geom->aabb[2 * axis + 1];
    }
  } else {
    boxes.boxes[slot] = box;
  }
  facts.coarse += bounds.coarse;
  facts.exact_boxes = facts.exact_boxes && bounds.exact;
  facts.unbounded += bounds.unbounded;
  facts.user_classes = facts.user_classes || isUserClass(geom);
  facts.spaces = facts.spaces || IS_SPACE(geom);

  facts.filter_bits = facts.filter_bits || ~geom->category_bits || ~geom->collide_bits;
  boxes.bits[slot] = {foldBits(geom->category_bits, facts), foldBits(geom->collide_bits, facts)};

  // Of two geoms on one body at least one is followed by another in the body's list.
  const std::uintptr_t body = reinterpret_cast<std::uintptr_t>(geom->body);
  boxes.bodies[slot] = static_cast<std::uint32_t>(body >> 4);
  if (body) {
    facts.filter_bodies = facts.filter_bodies || geom->body_next;
    if (!some_body) some_body = body;
    if ((body ^ some_body) & ~body_bits) facts.exact_bodies = false;
    if (!(body & body_bits)) facts.exact_bodies = false;
  }
}

void prefetch(const void* object, std::size_t size) {
  const char* const bytes = static_cast<const char*>(object);
  for (std::size_t line = 0; line < size; line += 64) __builtin_prefetch(bytes + line);
  __builtin_prefetch(bytes + size - 1);
}

void prefetchGeoms(dxGeom* const* geoms, const Range& range) {
  // The derived classes' sizes follow the base: one line more holds most of them.
  for (std::size_t i = range.begin; i < range.end; ++i)
    if (geoms[i]) prefetch(geoms[i], sizeof(dxGeom) + 32);
}

void prefetchPoses(dxGeom* const* geoms, const Range& range) {
  for (std::size_t i = range.begin; i < range.end; ++i)
    if (geoms[i] && geoms[i]->final_posr) prefetch(geoms[i]->final_posr, sizeof(dxPosR));
}

}  // namespace

void UpdateFacts::add(const UpdateFacts& other) {
  moved += other.moved;
  disabled += other.disabled;
  unbounded += other.unbounded;
  coarse += other.coarse;
  user_classes = user_classes || other.user_classes;
  spaces = spaces || other.spaces;
  exact_bits = exact_bits && other.exact_bits;
  exact_bodies = exact_bodies && other.exact_bodies;
  exact_boxes = exact_boxes && other.exact_boxes;
  filter_bits = filter_bits || other.filter_bits;
  filter_bodies = filter_bodies || other.filter_bodies;
  invalid.insert(invalid.end(), other.invalid.begin(), other.invalid.end());
}

int GeomUpdate::run(dxGeom* const* geoms, std::size_t slots, int threads, BoxSet* boxes) {
  const int parts = threads;
  if (parts_.size() < static_cast<std::size_t>(parts) + 1) parts_.resize(parts + 1);
  part_count_ = parts;
  int used = 1;
  runTeam(parts, [&](int thread, int team) {
    if (thread == 0) used = team;
    for (int index = thread; index < parts; index += team) {
      Part& part = parts_[index];
      part.facts = UpdateFacts();
      part.deferred.clear();
      part.some_body = 0;
      const Range range = partOf(slots, index, parts);
      const auto block = [&](std::size_t begin) {
        return Range{std::min(begin, range.end), std::min(begin + block_size, range.end)};
      };
      prefetchGeoms(geoms, block(range.begin));
      prefetchPoses(geoms, block(range.begin));
      prefetchGeoms(geoms, block(range.begin + block_size));
      for (std::size_t begin = range.begin; begin < range.end; begin += block_size) {
        const std::size_t end = block(begin).end;
        prefetchGeoms(geoms, block(begin + 2 * block_size));
        prefetchPoses(geoms, block(begin + block_size));
        for (std::size_t i = begin; i < end; ++i) {
          dxGeom* const geom = geoms[i];
          if (!geom || !(geom->gflags & GEOM_DIRTY)) continue;
          ++part.facts.moved;
          if (needsCallingThread(geom))
            part.deferred.push_back(static_cast<Slot>(i));
          else
            cleanGeom(geom);
        }
        if (!boxes) continue;
        const ScopedMode exact(exactMode());
        for (std::size_t i = begin; i < end; ++i) {
          const dxGeom* const geom = geoms[i];
          if (!geom || !(geom->gflags & GEOM_DIRTY))
            packGeom(geom, static_cast<Slot>(i), part.facts, part.some_body, *boxes);
        }
      }
    }
  });
  Part& serial = parts_[parts];
  serial.facts = UpdateFacts();
  serial.some_body = 0;
  for (int index = 0; index < parts; ++index)
    for (const Slot slot : parts_[index].deferred) {
      cleanGeom(geoms[slot]);
      if (!boxes) continue;
      const ScopedMode exact(exactMode());
      packGeom(geoms[slot], slot, serial.facts, serial.some_body, *boxes);
    }
  return used;
}

void GeomUpdate::clean(dxGeom* const* geoms, std::size_t slots, int threads) {
  run(geoms, slots, threads, nullptr);
}

int GeomUpdate::pack(dxGeom* const* geoms, std::size_t slots, int threads, BoxSet& boxes) {
  boxes.size = slots;
  boxes.bits.resizeDiscarding(slots);
  boxes.bodies.resizeDiscarding(slots);
  std::size_t moved = 0;
  for (;;) {
    if (boxes.wide)
      boxes.wide_boxes.resizeDiscarding(slots);
    else
      boxes.boxes.resizeDiscarding(slots);
    const int used = run(geoms, slots, threads, &boxes);
    mergeFacts();
    moved += facts_.moved;
    facts_.moved = moved;
    const bool wide = needsDoubles(facts_.coarse, slots, boxes.wide);
    if (wide == boxes.wide) return used;
    boxes.wide = wide;
    (wide ? boxes.boxes.release() : boxes.wide_boxes.release());
  }
}

void GeomUpdate::mergeFacts() {
  facts_ = UpdateFacts();
  std::uintptr_t some_body = 0;
  for (int index = 0; index <= part_count_; ++index) {
    const Part& part = parts_[index];
    facts_.add(part.facts);
    if (!part.some_body) continue;
    if (!some_body) some_body = part.some_body;
    if ((part.some_body ^ some_body) & ~body_bits) facts_.exact_bodies = false;
  }
  std::sort(facts_.invalid.begin(), facts_.invalid.end());
}

// Where addresses are too far apart for 32 of their bits to tell them apart.
void GeomUpdate::numberBodies(dxGeom* const* geoms, BoxSet& boxes) {
  body_numbers_.clear();
  for (std::size_t slot = 0; slot < boxes.size; ++slot) {
    const dxBody* const body = geoms[slot] ? geoms[slot]->body : nullptr;
    boxes.bodies[slot] =
        body ? body_numbers_.emplace(body, static_cast<std::uint32_t>(body_numbers_.size() + 1))
                   .first->second
             : 0;
  }
}

const UpdateFacts& GeomUpdate::synchronise(dxGeom* const* geoms, BoxSet& boxes) {
  if (facts_.filter_bodies && !facts_.exact_bodies) numberBodies(geoms, boxes);
  facts_.exact_boxes = facts_.exact_boxes || boxes.wide || std::is_same<dReal, float>::value;
  boxes.exact = facts_.exact_boxes;
  boxes.filter_bits = facts_.filter_bits;
  boxes.filter_bodies = facts_.filter_bodies;
  return facts_;
}

}  // namespace ode_parallel_sap
