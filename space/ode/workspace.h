// What a call of a space holds while it calls back, owned by the space.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <memory>

#include "space/base/buffer.h"
#include "space/frame/frame.h"
#include "space/queries/geom_tree.h"
#include "space/rays/overlap_finder.h"
#include "space/rays/ray_caster.h"

namespace ode_parallel_sap {

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

// One call. A callback may leave it by longjmp, which runs no destructor. So a call owns nothing:
// it uses a workspace, and the next call finds out whether that one has ended. A call at the same
// or a shallower depth of the same stack proves it. A deeper call, or one on another stack of the
// thread, counts as one within a callback: its pairs are right, but it keeps nothing and reports no
// events.
class WorkspaceUse {
 public:
  // `outermost`: of calls that are within no callback; null: it has no workspace. `alone`: all
  // other calls have ended. The call's part of the stack goes on to `end`.
  WorkspaceUse(Workspace* outermost, bool alone, void* end)
      : workspace_(outermost), nested_(false) {
    if (alone && outermost && !outermost->inner)
      workspace_->taken_at = reinterpret_cast<const char*>(this);
    else
      enter(alone, end);
  }
  ~WorkspaceUse() {
    if (workspace_) workspace_->taken_at = nullptr;
  }
  WorkspaceUse(const WorkspaceUse&) = delete;
  WorkspaceUse& operator=(const WorkspaceUse&) = delete;

  // Null also without memory for an inner one.
  Workspace* workspace() const { return workspace_; }
  // Those lists of it; null without memory.
  template <class Lists>
  Lists* lists(std::unique_ptr<Lists> Workspace::*lists) const {
    return workspace_ ? made(workspace_->*lists) : nullptr;
  }
  // Whether it is within a callback of this space.
  bool nested() const { return nested_; }

 private:
  void enter(bool alone, void* end);

  Workspace* workspace_;
  bool nested_;
};

}  // namespace ode_parallel_sap
