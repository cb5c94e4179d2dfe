// The pairs of planes with all other geoms, less those that are clear of them. Sees ODE's private
// headers.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/geoms/pack_rules.h"
#include "space/pairs/radix_sort.h"
#include "space/simd/kernels.h"

struct dxGeom;

namespace ode_parallel_sap {

// Most planes reach no more than a few of the geoms, but the bounding boxes of oblique ones reach
// all. So planes are taken out of the boxes before pairs are found, and then their half-spaces are
// tested against the boxes, sixteen at a time: conservatively, in the boxes' own precision. Those
// that may touch are tested again on the geoms (isClearOfPlane), which has the last word, so that
// the pairs do not depend on how the boxes were rounded.
class PlanePairs {
 public:
  // Forgets which slots hold planes: call when geoms come, go or change slots.
  void forget() { known_ = false; }

  // Takes the planes out of `boxes`, which are packed. Looks for them among all geoms only after
  // forget().
  void take(dxGeom* const* geoms, BoxSet& boxes);
  bool any() const { return planes_.size() != 0; }

  // What planes pair with.
  struct Others {
    dxGeom* const* geoms;
    const BoxSet& boxes;
    const PackRules& rules;
    bool user_classes;  // AABBTest functions are called
  };

  // Finds the pairs of the planes with all boxes and with each other that pass ODE's formula and
  // are not clear nor left out by the rules, and leaves them in `pairs`, together with the
  // `others`, which may be the same list. All are ascending. Returns the number of pairs added.
  std::size_t addTo(const PairList& others, const Others& of, int threads, PairList& pairs);
  std::size_t bytes() const {
    return bytesOf(all_planes_, planes_, found_, hits_, scratch_, list_);
  }

 private:
  template <class Real>
  struct Search;

  template <class Real>
  void find(dxGeom* const* geoms, const BoxSet& boxes, const PackRules& rules, int threads);
  void findAmongPlanes(dxGeom* const* geoms, const PackRules& rules, Buffer<Pair>& found) const;
  static void merge(const PairList& others, const Buffer<Pair>& added, PairList& merged);

  bool known_ = false;
  Buffer<Slot> all_planes_;                  // of the space
  Buffer<Slot> planes_;                      // of this frame: the enabled ones without NaN
  std::vector<Buffer<Pair>> found_;          // one a thread
  std::vector<Buffer<HalfSpaceHits>> hits_;  // one a thread
  Buffer<Pair> scratch_;                     // to sort with
  PairList list_;
};

}  // namespace ode_parallel_sap
