// Whether cells that were cut for an earlier frame's boxes are still good.
#pragma once

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/slot_set.h"
#include "space/pairs/cell_trees.h"

namespace ode_parallel_sap {

// Boxes that were neighbours in one frame are neighbours in the next. Cells need not be cut anew
// while they hold the same slots and have hardly grown: any division into cells leads to the same
// pairs, and how long that takes depends on the extents of the cells.
template <class Real>
class CellCoherence {
 public:
  // Whether to try the cells of before for these boxes: if they hold all active slots and no
  // others, and are not too old. Called before cells are cut or packed.
  bool mayReuse(const BoxSet& boxes, int threads);
  // Whether they are good, `trees` being packed with the new boxes.
  bool reuse(const CellTrees<Real>& trees);
  // The cells are about to be cut anew.
  void forget() { known_ = false; }
  // Cells were cut anew for the boxes that mayReuse() saw, and packed.
  void restart(const CellTrees<Real>& trees);

  std::size_t bytes() const { return bytesOf(active_, spans_, spans_when_cut_); }

 private:
  bool known_ = false;
  std::size_t size_ = 0;
  SlotSet active_;                          // slots that mayReuse() saw last
  Buffer<Real> spans_, spans_when_cut_[2];  // of all below the nodes of the two lowest levels
  int reuses_ = 0;                          // frames since the cells were cut
};

}  // namespace ode_parallel_sap
