#include "space/geoms/plane_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "space/base/parallel.h"
#include "space/base/tuning.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

constexpr dReal least_normal = static_cast<dReal>(1e-30);

Region meeting("planes: cells");

// What meetHalfSpaces() computes in the precision of the boxes is off by less than 8 epsilon of the
// numbers' size: rounding of bounds, normal and distance, three products, two sums. Beyond that it
// leaves to isClearOfPlane() all that this might not call clear, and a tenth more.
template <class Real>
HalfSpace<Real> halfSpaceOf(dxGeom* geom) {
  dVector4 plane;
  dGeomPlaneGetParams(geom, plane);
  HalfSpace<Real> half_space;
  half_space.distance = plane[3];
  half_space.rounding =
      8 * static_cast<double>(std::numeric_limits<Real>::epsilon()) + 1.1 * plane_rounding;
  for (int axis = 0; axis < 3; ++axis) {
    half_space.normal[axis] = static_cast<Real>(plane[axis]);
    // Too near the denormals for that: nothing is decided.
    if (plane[axis] != 0 && !(std::fabs(plane[axis]) > least_normal))
      half_space.rounding = std::numeric_limits<double>::infinity();
  }
  return half_space;
}

}  // namespace

void PlanePairs::take(dxGeom* const* geoms, BoxSet& boxes) {
  if (!known_) {
    all_planes_.resizeDiscarding(0);
    for (std::size_t slot = 0; slot < boxes.size; ++slot)
      if (geoms[slot] && geoms[slot]->type == dPlaneClass)
        all_planes_.push_back(static_cast<Slot>(slot));
    known_ = true;
  }
  planes_.resizeDiscarding(0);
  for (const Slot slot : all_planes_) {
    if (PairRule::takesPart(geoms[slot])) planes_.push_back(slot);
    boxes.deactivate(slot);
  }
}

// One thread's part of the search.
template <class Real>
struct PlanePairs::Search {
  dxGeom* const* geoms;
  const BoxSet& boxes;
  const PairRule rule;
  const Buffer<Slot>& planes;
  const std::vector<HalfSpace<Real>>& half_spaces;

  void run(const Range& cells, Buffer<HalfSpaceHits>& hits, Buffer<Pair>& found) const {
    hits.resizeDiscarding((cells.end - cells.begin) * half_spaces.size());
    const std::size_t count =
        kernels<Real>().meetHalfSpaces(boxesOf<Real>(boxes), boxes.size, cells.begin, cells.end,
                                       {half_spaces.data(), half_spaces.size()}, hits.data());
    for (std::size_t i = 0; i < count; ++i) {
      const HalfSpaceHits& hit = hits[i];
      const Slot plane = planes[hit.plane];
      for (unsigned lanes = hit.maybe; lanes; lanes &= lanes - 1) {
        const int lane = __builtin_ctz(lanes);
        const Slot other = hit.cell * group_size + lane;
        if (passes(plane, other, hit.sure >> lane & 1))
          found.push_back(makePair(std::min(plane, other), std::max(plane, other)));
      }
    }
  }

  bool passes(Slot plane, Slot other, bool sure) const {
    dxGeom *const a = geoms[plane], *const b = geoms[other];
    if (!sure && (!boxesOverlap(a, b) || rule.isClear(a, b))) return false;
    return isEnabled(b) && rule.mayMeet(a, b);
  }
};

template <class Real>
void PlanePairs::find(dxGeom* const* geoms, const BoxSet& boxes, const PackRules& rules,
                      int threads) {
  std::vector<HalfSpace<Real>> half_spaces;
  for (const Slot slot : planes_) half_spaces.push_back(halfSpaceOf<Real>(geoms[slot]));
  const std::size_t cells = (boxes.size + group_size - 1) / group_size;
  threads = teamFor(cells * planes_.size(), grains::geom_tests, threads);
  clearForTeam(found_, threads);
  clearForTeam(hits_, threads);
  ChunkQueue queue(cells, chunkOf(cells, chunk_cells, threads));
  runTeam(meeting, threads, [&](int thread, int) {
    const ScopedMode mode(exactMode());
    const Search<Real> search = {geoms, boxes, PairRule(rules), planes_, half_spaces};
    for (Range range; queue.next(range);) search.run(range, hits_[thread], found_[thread]);
  });
}

// No plane's AABB is clear of another plane: they pair as in ODE.
void PlanePairs::findAmongPlanes(dxGeom* const* geoms, const PackRules& rules,
                                 Buffer<Pair>& found) const {
  const ScopedMode mode(exactMode());
  const PairRule rule(rules);
  for (std::size_t i = 0; i < planes_.size(); ++i)
    for (std::size_t j = i + 1; j < planes_.size(); ++j) {
      dxGeom *const a = geoms[planes_[i]], *const b = geoms[planes_[j]];
      if (rule.isPair(a, b)) found.push_back(makePair(planes_[i], planes_[j]));
    }
}

std::size_t PlanePairs::addTo(const PairList& others, const Others& of, int threads,
                              PairList& pairs) {
  dxGeom* const* const geoms = of.geoms;
  const BoxSet& boxes = of.boxes;
  const PackRules& rules = of.rules;
  if (boxes.wide)
    find<double>(geoms, boxes, rules, threads);
  else
    find<float>(geoms, boxes, rules, threads);
  findAmongPlanes(geoms, rules, found_[0]);
  sortPairs(found_, boxes.size, threads, scratch_, list_);
  Buffer<Pair>& added = list_.parts[0];
  if (of.user_classes)
    added.resize(std::remove_if(added.begin(), added.end(),
                                [&](Pair pair) {
                                  return !passesAABBTests(geoms[earlierOf(pair)],
                                                          geoms[laterOf(pair)]);
                                }) -
                 added.begin());
  merge(others, added, pairs);
  return added.size();
}

void PlanePairs::merge(const PairList& others, const Buffer<Pair>& added, PairList& merged) {
  merged.clear(1);
  merged.parts[0].resizeDiscarding(others.size() + added.size());
  Pair* next = merged.parts[0].data();
  const Pair* add = added.begin();
  for (const Buffer<Pair>& part : others.parts)
    for (const Pair* pair = part.begin(); pair < part.end();) {
      while (add < added.end() && *add < *pair) *next++ = *add++;
      const Pair* const run_end =
          add < added.end() ? std::lower_bound(pair, part.end(), *add) : part.end();
      next = std::copy(pair, run_end, next);
      pair = run_end;
    }
  std::copy(add, added.end(), next);
}

}  // namespace ode_parallel_sap
