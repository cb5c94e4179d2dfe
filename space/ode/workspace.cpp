#include "space/ode/workspace.h"

#include <new>

#if defined(__linux__)
#include <pthread.h>
#endif

namespace ode_parallel_sap {

namespace {

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

void WorkspaceUse::enter(bool alone, void* end) {
  Workspace* const outermost = workspace_;
  while (!alone && workspace_ && workspace_->taken_at &&
         !hasEnded(*workspace_, static_cast<const char*>(end))) {
    if (!workspace_->inner) workspace_->inner.reset(new (std::nothrow) Workspace);
    workspace_ = workspace_->inner.get();
  }
  nested_ = workspace_ != outermost;
  for (Workspace* ended = workspace_; ended; ended = ended->inner.get()) ended->taken_at = nullptr;
  if (workspace_) workspace_->taken_at = reinterpret_cast<const char*>(this);
}

}  // namespace ode_parallel_sap
