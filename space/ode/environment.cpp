#include "space/ode/environment.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <locale>
#include <sstream>
#include <string>

#include "space/data/team.h"
#include "space/extract/device_backend.h"
#include "space/ode/environment_switch.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

struct Name {
  int value;
  const char* name;
};
constexpr Name backends[] = {{dParallelSAPBackendAuto, "auto"},
                             {dParallelSAPBackendCPU, "cpu"},
                             {dParallelSAPBackendCUDA, "cuda"}};
constexpr Name methods[] = {{dParallelSAPMethodAuto, "auto"},
                            {dParallelSAPMethodSweep, "sweep"},
                            {dParallelSAPMethodBruteForce, "brute-force"},
                            {dParallelSAPMethodAxisLists, "axis-lists"}};
// Whatever the processor: those of others are known, and not to be had. By their values.
constexpr Name instruction_sets[] = {
    {0, "portable"}, {1, "sse2"}, {2, "avx2"}, {3, "avx512"}, {4, "neon"}};

constexpr Name precompute_modes[] = {{static_cast<int>(Precompute::where_it_pays), "auto"},
                                     {static_cast<int>(Precompute::never), "off"},
                                     {static_cast<int>(Precompute::always), "on"}};

enum { silent_changes, told_changes, checked_changes };
constexpr Name notified_modes[] = {
    {silent_changes, "0"}, {told_changes, "1"}, {checked_changes, "check"}};

template <std::size_t count>
bool isNamed(const Name (&names)[count], int value) {
  return std::any_of(names, names + count, [=](const Name& name) { return name.value == value; });
}

// Null where a variable is not set, or to nothing.
const char* textOf(const char* variable) {
  const char* const text = std::getenv(variable);
  return text && *text ? text : nullptr;
}

bool isAlwaysHad(int) {
  return true;
}

template <std::size_t count>
void readName(const char* variable, const Name (&names)[count], int& value,
              bool (*has)(int) = isAlwaysHad) {
  const char* const text = textOf(variable);
  if (!text) return;
  for (const Name& name : names) {
    if (std::strcmp(text, name.name) != 0) continue;
    if (has(name.value))
      value = name.value;
    else
      dMessage(0, "%s=%s is not to be had here and is ignored", variable, text);
    return;
  }
  dMessage(0, "%s=%s is not understood and is ignored", variable, text);
}

const KernelSet* instructionSet(int value) {
  return kernelSetNamed(instruction_sets[value].name);
}

// Of the whole process, so of the spaces that there are, too.
void chooseInstructionSet() {
  int value = -1;
  readName("ODE_PARALLEL_SAP_SIMD", instruction_sets, value,
           [](int set) { return instructionSet(set) != nullptr; });
  chooseKernelSet(value < 0 ? *allKernelSets()[0] : *instructionSet(value));
}

void readCount(const char* variable, int most, int& value) {
  const char* const text = textOf(variable);
  if (!text) return;
  char* end = nullptr;
  errno = 0;
  const long count = std::strtol(text, &end, 10);
  if (*end != '\0' || count < 0 || errno != 0)
    dMessage(0, "%s=%s is not a count and is ignored", variable, text);
  else
    value = static_cast<int>(std::min<long>(count, most));
}

void readSwitch(const char* variable, bool& value) {
  const char* const text = textOf(variable);
  if (!text) return;
  const int on = switchOf(text);
  if (on < 0)
    dMessage(0, "%s=%s is neither 0 nor 1 and is ignored", variable, text);
  else
    value = on != 0;
}

// Written as in C, whatever the program's locale: 0.05 has a point.
void readLength(const char* variable, dReal& value) {
  const char* const text = textOf(variable);
  if (!text) return;
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double length = -1;
  const bool whole = in >> length && in.peek() == std::istringstream::traits_type::eof();
  if (whole && length >= 0 && length <= std::numeric_limits<dReal>::max())
    value = static_cast<dReal>(length);
  else
    dMessage(0, "%s=%s is not a length, 0 or more and finite, and is ignored", variable, text);
}

int notifiedMode(int mode) {
  readName("ODE_PARALLEL_SAP_NOTIFIED", notified_modes, mode);
  return mode;
}

// What a program may set on a space by itself, in the same words.
void readRules(PackRules& rules) {
  readSwitch("ODE_PARALLEL_SAP_SKIP_STATIC", rules.skip_static);
  readSwitch("ODE_PARALLEL_SAP_SKIP_ASLEEP", rules.skip_asleep);
  readSwitch("ODE_PARALLEL_SAP_CULL_PLANES", rules.cull_planes);
  readLength("ODE_PARALLEL_SAP_TOLERANCE", rules.tolerance);
  const int notified = notifiedMode(silent_changes);
  rules.notified = notified == told_changes;
  rules.checked = notified == checked_changes;
}

}  // namespace

bool isBackend(int number) {
  return isNamed(backends, number);
}

bool isMethod(int number) {
  return isNamed(methods, number);
}

bool hasBackend(int backend) {
  return backend != dParallelSAPBackendCUDA || deviceAvailable();
}

Settings settingsFromEnvironment() {
  Settings settings;
  constexpr int most_devices = 1024;       // fixed: beyond it is a slip of the pen
  constexpr int most_megabytes = 1 << 30;  // fixed: likewise
  readName("ODE_PARALLEL_SAP_BACKEND", backends, settings.backend, hasBackend);
  readName("ODE_PARALLEL_SAP_METHOD", methods, settings.method);
  readCount("ODE_PARALLEL_SAP_THREADS", most_threads, settings.threads);
  readCount("ODE_PARALLEL_SAP_DEVICES", most_devices, settings.devices);
  readRules(settings.rules);
  readSwitch("ODE_PARALLEL_SAP_STATS", settings.print_stats);
  // Not part of the interface: lets tests come to the limit without filling the machine.
  int megabytes = 0;
  readCount("ODE_PARALLEL_SAP_AXIS_LISTS_MB", most_megabytes, megabytes);
  settings.axis_lists_bytes = std::uint64_t(megabytes) << 20;
  // Nor is this: makes teams of little work, see team.h.
  int grain = 0;
  readCount("ODE_PARALLEL_SAP_TEST_GRAIN", std::numeric_limits<int>::max(), grain);
  if (grain > 0) test_grain.store(static_cast<std::uint64_t>(grain), std::memory_order_relaxed);
  // Nor this: 0 collides pairs that are certainly apart, too, 1 looks for them where it does not
  // pay.
  readCount("ODE_PARALLEL_SAP_TEST_APART", 1, settings.apart);
  chooseInstructionSet();
  return settings;
}

Precompute precomputeFromEnvironment() {
  int value = static_cast<int>(Precompute::where_it_pays);
  readName("ODE_PARALLEL_SAP_CONTACTS", precompute_modes, value);
  return static_cast<Precompute>(value);
}

bool standInsAreTold() {
  return notifiedMode(told_changes) != silent_changes;
}

// path[:every]. A colon that no number follows is part of the path.
std::unique_ptr<Trace> traceFromEnvironment() {
  const char* const text = textOf("ODE_PARALLEL_SAP_TRACE");
  if (!text) return nullptr;
  std::string path = text;
  int every = 1;
  const std::size_t colon = path.rfind(':');
  if (colon != std::string::npos && colon + 1 < path.size() &&
      path.find_first_not_of("0123456789", colon + 1) == std::string::npos) {
    errno = 0;
    const long number = std::strtol(path.c_str() + colon + 1, nullptr, 10);
    every = static_cast<int>(std::min<long>(number, std::numeric_limits<int>::max()));
    path.resize(colon);
  }
  if (every < 1 || path.empty()) {
    dMessage(0, "ODE_PARALLEL_SAP_TRACE=%s is not a path[:every] and is ignored", text);
    return nullptr;
  }
  auto trace = std::make_unique<Trace>(every);
  trace->openLater(path);
  return trace;
}

}  // namespace ode_parallel_sap
