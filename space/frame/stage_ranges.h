// The stages of a frame as ranges that profilers show.
#pragma once

namespace ode_parallel_sap {

// As in the statistics.
enum class Stage { update, synchronise, extract, filter, events, narrow, report, rays, none };

// A range of the calling thread, from begin() to the next one or the end of this object: of NVTX,
// as a task of ITT, or of both, by what the library was built with. Ranges within the report's are
// those of collides that its callback makes. Stages that have nothing to do have no range.
//
// Where no profiler is attached NVTX and ITT test a pointer; what they load (NVTX_INJECTION64_PATH,
// INTEL_LIBITTNOTIFY64) they look for at the first range.
class StageRange {
 public:
  StageRange() = default;
  explicit StageRange(Stage stage) { begin(stage); }
  ~StageRange() { begin(Stage::none); }
  StageRange(const StageRange&) = delete;
  StageRange& operator=(const StageRange&) = delete;

#if defined(ODE_PARALLEL_SAP_NVTX) || defined(ODE_PARALLEL_SAP_ITT)
  void begin(Stage stage);

 private:
  Stage stage_ = Stage::none;
#else
  void begin(Stage) {}
#endif
};

}  // namespace ode_parallel_sap
