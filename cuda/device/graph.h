// Work that is the same frame after frame, handed to the device in one call.
#pragma once

#include <cuda_runtime_api.h>

#include <array>
#include <cstddef>

#include "cuda/device/device.h"

namespace ode_parallel_sap {

// Starting some twenty short kernels one by one takes longer than they run where boxes are few. The
// second time in a row that the same work comes, it is recorded, and from then on replayed.
class CachedGraph {
 public:
  CachedGraph() = default;
  ~CachedGraph() { release(); }
  CachedGraph(const CachedGraph&) = delete;
  CachedGraph& operator=(const CachedGraph&) = delete;

  // What makes two frames' work the same: sizes, and that no buffer was moved in between, which
  // shows in their bytes.
  using Key = std::array<std::size_t, 6>;

  // Has work() done on `stream`, to which it must keep. work() may be called while the stream is
  // recorded, so it must neither wait nor allocate; but the first time of a key it may allocate.
  // For that `keyNow` is asked before and after.
  template <class KeyNow, class Work>
  void run(KeyNow keyNow, cudaStream_t stream, Work work) {
    const Key key = keyNow();
    if (graph_ && key == key_) {
      CHECK_CUDA(cudaGraphLaunch(graph_, stream));
    } else if (seen_ && key == key_) {
      record(stream, work);
      CHECK_CUDA(cudaGraphLaunch(graph_, stream));
    } else {
      release();
      work();
      key_ = keyNow();
      seen_ = true;
    }
  }
  void release() {
    if (graph_) cudaGraphExecDestroy(graph_);
    graph_ = nullptr;
    seen_ = false;
  }

 private:
  template <class Work>
  void record(cudaStream_t stream, Work work) {
    CHECK_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    cudaGraph_t recorded = nullptr;
    try {
      work();
    } catch (...) {
      cudaStreamEndCapture(stream, &recorded);
      if (recorded) cudaGraphDestroy(recorded);
      throw;
    }
    CHECK_CUDA(cudaStreamEndCapture(stream, &recorded));
    const cudaError_t status = cudaGraphInstantiate(&graph_, recorded, 0);
    cudaGraphDestroy(recorded);
    CHECK_CUDA(status);
  }

  cudaGraphExec_t graph_ = nullptr;
  Key key_ = {};
  bool seen_ = false;
};

}  // namespace ode_parallel_sap
