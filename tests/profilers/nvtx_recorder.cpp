// A profiler as NVTX loads it (NVTX_INJECTION64_PATH): says on stderr which ranges begin and end.
#include <nvtx3/nvToolsExt.h>

#include <cstdint>
#include <cstdio>

namespace {

int push(nvtxDomainHandle_t, const nvtxEventAttributes_t* event) {
  std::fprintf(stderr, "+ %s\n", event->message.ascii);
  return 0;
}

int pop(nvtxDomainHandle_t) {
  std::fprintf(stderr, "-\n");
  return 0;
}

nvtxDomainHandle_t createDomain(const char* name) {
  std::fprintf(stderr, "domain %s\n", name);
  return reinterpret_cast<nvtxDomainHandle_t>(1);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) int InitializeInjectionNvtx2(
    NvtxGetExportTableFunc_t table_of) {
  const auto* const callbacks =
      static_cast<const NvtxExportTableCallbacks*>(table_of(NVTX_ETID_CALLBACKS));
  NvtxFunctionTable table = nullptr;
  unsigned size = 0;
  if (!callbacks || !callbacks->GetModuleFunctionTable(NVTX_CB_MODULE_CORE2, &table, &size))
    return 0;
  *table[NVTX_CBID_CORE2_DomainRangePushEx] = reinterpret_cast<NvtxFunctionPointer>(push);
  *table[NVTX_CBID_CORE2_DomainRangePop] = reinterpret_cast<NvtxFunctionPointer>(pop);
  *table[NVTX_CBID_CORE2_DomainCreateA] = reinterpret_cast<NvtxFunctionPointer>(createDomain);
  return 1;
}
