#include "space/frame/stage_ranges.h"

#if defined(ODE_PARALLEL_SAP_NVTX)
#include <nvtx3/nvToolsExt.h>
#endif
#if defined(ODE_PARALLEL_SAP_ITT)
#include <ittnotify.h>
#endif

#if defined(ODE_PARALLEL_SAP_NVTX) || defined(ODE_PARALLEL_SAP_ITT)

namespace ode_parallel_sap {

namespace {

constexpr const char* domain_name = "ode-parallel-sap";
constexpr int stages = static_cast<int>(Stage::none);
constexpr const char* names[stages] = {"update", "synchronise", "extract", "filter",
                                       "events", "narrow",      "report",  "rays"};

#if defined(ODE_PARALLEL_SAP_NVTX)
class Nvtx {
 public:
  void push(Stage stage) const {
    nvtxDomainRangePushEx(domain_, &events_[static_cast<int>(stage)]);
  }
  void pop() const { nvtxDomainRangePop(domain_); }
  static const Nvtx& get() {
    static const Nvtx nvtx;
    return nvtx;
  }

 private:
  Nvtx() : domain_(nvtxDomainCreateA(domain_name)) {
    for (int i = 0; i < stages; ++i) {
      events_[i].version = NVTX_VERSION;
      events_[i].size = NVTX_EVENT_ATTRIB_STRUCT_SIZE;
      events_[i].messageType = NVTX_MESSAGE_TYPE_ASCII;
      events_[i].message.ascii = names[i];
    }
  }

  const nvtxDomainHandle_t domain_;
  nvtxEventAttributes_t events_[stages] = {};
};
#endif

#if defined(ODE_PARALLEL_SAP_ITT)
class Itt {
 public:
  void push(Stage stage) const {
    __itt_task_begin(domain_, __itt_null, __itt_null, names_[static_cast<int>(stage)]);
  }
  void pop() const { __itt_task_end(domain_); }
  static const Itt& get() {
    static const Itt itt;
    return itt;
  }

 private:
  Itt() : domain_(__itt_domain_create(domain_name)) {
    for (int i = 0; i < stages; ++i) names_[i] = __itt_string_handle_create(names[i]);
  }

  __itt_domain* const domain_;
  __itt_string_handle* names_[stages];
};
#endif

}  // namespace

void StageRange::begin(Stage stage) {
  const auto change = [&](const auto& profiler) {
    if (stage_ != Stage::none) profiler.pop();
    if (stage != Stage::none) profiler.push(stage);
  };
  if (stage == stage_) return;
#if defined(ODE_PARALLEL_SAP_NVTX)
  change(Nvtx::get());
#endif
#if defined(ODE_PARALLEL_SAP_ITT)
  change(Itt::get());
#endif
  stage_ = stage;
}

}  // namespace ode_parallel_sap

#endif
