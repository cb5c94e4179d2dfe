#include "space/ode/environment.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <locale>
#include <mutex>
#include <set>
#include <sstream>
#include <string_view>

#include "space/base/pair_list.h"
#include "space/base/parallel.h"
#include "space/base/platform.h"
#include "space/finders/extraction.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// By their values.
static_assert(dParallelSAPBackendAuto == 0 && dParallelSAPBackendCUDA == 2, "in this order");
static_assert(dParallelSAPMethodAuto == 0 && dParallelSAPMethodAxisLists == 3, "in this order");
constexpr std::initializer_list<const char*> backends = {"auto", "cpu", "cuda"};
constexpr std::initializer_list<const char*> methods = {"auto", "sweep", "brute-force",
                                                        "axis-lists"};
// Whatever the processor: those of others are known, and not to be had.
constexpr std::initializer_list<const char*> instruction_sets = {"portable", "sse2", "avx2",
                                                                 "avx512", "neon"};

// All that any part of the library reads; those that begin with TEST_ are the tests'.
constexpr std::initializer_list<const char*> variables = {
    "BACKEND",     "METHOD",      "THREADS",   "DEVICES",  "SKIP_STATIC",
    "SKIP_ASLEEP", "CULL_PLANES", "TOLERANCE", "NOTIFIED", "STATS",
    "SIMD",        "TRACE",       "REPLACE",   "CONTACTS", "FIRST"};
constexpr std::initializer_list<const char*> inner_variables = {"AXIS_LISTS_MB", "VIRTUAL_DEVICES"};

// Null where a variable is not set, or to nothing.
const char* textOf(const char* variable) {
  const char* const text = std::getenv(variable);
  return text && *text ? text : nullptr;
}

void complain(const char* variable, const char* text, const std::string& why) {
  complainOnce(std::string(variable) + "=" + text + " is " + why + " and is ignored");
}

std::string join(std::initializer_list<const char*> names) {
  std::string all;
  for (const char* const name : names) all += (all.empty() ? "" : ", ") + std::string(name);
  return all;
}

// Names that begin as the library's do and are none of them.
void complainOfNames() {
  constexpr std::string_view prefix = "ODE_PARALLEL_SAP_", of_tests = "TEST_";
  for (char** entry = environment(); entry && *entry; ++entry) {
    const std::string_view whole = *entry;
    if (whole.substr(0, prefix.size()) != prefix) continue;
    const std::string_view name = whole.substr(0, whole.find('=')).substr(prefix.size());
    const auto isName = [name](const char* known) { return name == known; };
    if (name.substr(0, of_tests.size()) == of_tests ||
        std::any_of(variables.begin(), variables.end(), isName) ||
        std::any_of(inner_variables.begin(), inner_variables.end(), isName))
      continue;
    complainOnce(
        std::string(prefix) + std::string(name) +
        " is no variable of this library and is ignored; after ODE_PARALLEL_SAP_ it knows " +
        join(variables));
  }
}

// Of the whole process, so of the spaces that there are, too.
void chooseInstructionSet() {
  constexpr const char* variable = "ODE_PARALLEL_SAP_SIMD";
  const int value = nameFromEnvironment(variable, instruction_sets, -1);
  const KernelSet* const set =
      value < 0 ? nullptr : kernelSetNamed(instruction_sets.begin()[value]);
  if (value >= 0 && !set) {
    std::string here;
    for (const char* const name : instruction_sets)
      if (kernelSetNamed(name)) here += (here.empty() ? "" : ", ") + std::string(name);
    complain(variable, textOf(variable), "not to be had here (only " + here + ")");
  }
  chooseKernelSet(set ? *set : *allKernelSets()[0]);
}

void readCount(const char* variable, int& value) {
  const char* const text = textOf(variable);
  if (!text) return;
  char* end = nullptr;
  errno = 0;
  const long count = std::strtol(text, &end, 10);
  if (*end != '\0' || count < 0 || errno != 0)
    complain(variable, text, "not a count, 0 or more,");
  else
    value = static_cast<int>(std::min<long>(count, std::numeric_limits<int>::max()));
}

void readSwitch(const char* variable, bool& value) {
  value = nameFromEnvironment(variable, {"0", "1"}, value) != 0;
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
    complain(variable, text, "not a length, 0 or more and finite,");
}

}  // namespace

void complainOnce(const std::string& text) {
  static std::mutex& mutex = *new std::mutex;
  static std::set<std::string>& said = *new std::set<std::string>;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    if (!said.insert(text).second) return;
  }
  dMessage(0, "%s", text.c_str());
}

int nameFromEnvironment(const char* variable, std::initializer_list<const char*> names, int value) {
  const char* const text = textOf(variable);
  if (!text) return value;
  int number = 0;
  for (const char* const name : names) {
    if (std::strcmp(text, name) == 0) return number;
    ++number;
  }
  complain(variable, text, "none of " + join(names));
  return value;
}

Settings settingsFromEnvironment() {
  Settings settings;
  constexpr const char* backend = "ODE_PARALLEL_SAP_BACKEND";
  settings.backend = nameFromEnvironment(backend, backends, settings.backend);
  std::string missing;
  if (settings.backend == dParallelSAPBackendCUDA && !deviceAvailable(&missing)) {
    complain(backend, "cuda", "not to be had (" + missing + ")");
    settings.backend = dParallelSAPBackendAuto;
  }
  settings.method = nameFromEnvironment("ODE_PARALLEL_SAP_METHOD", methods, settings.method);
  readCount("ODE_PARALLEL_SAP_THREADS", settings.threads);
  settings.threads = std::min(settings.threads, most_threads);
  readCount("ODE_PARALLEL_SAP_DEVICES", settings.devices);
  readSwitch("ODE_PARALLEL_SAP_SKIP_STATIC", settings.rules.skip_static);
  readSwitch("ODE_PARALLEL_SAP_SKIP_ASLEEP", settings.rules.skip_asleep);
  readSwitch("ODE_PARALLEL_SAP_CULL_PLANES", settings.rules.cull_planes);
  readLength("ODE_PARALLEL_SAP_TOLERANCE", settings.rules.tolerance);
  const int notified = nameFromEnvironment("ODE_PARALLEL_SAP_NOTIFIED", notified_modes, 0);
  settings.rules.notified = notified == 1;
  settings.rules.checked = notified == 2;
  readSwitch("ODE_PARALLEL_SAP_STATS", settings.print_stats);
  // Not part of the interface: lets tests come to the limit without filling the machine.
  int megabytes = 0;
  readCount("ODE_PARALLEL_SAP_AXIS_LISTS_MB", megabytes);
  most_list_bytes.store(std::uint64_t(megabytes) << 20, std::memory_order_relaxed);
  // Nor is this: makes teams of little work, see parallel.h.
  int grain = 0;
  readCount("ODE_PARALLEL_SAP_TEST_GRAIN", grain);
  if (grain > 0) test_grain.store(static_cast<std::uint64_t>(grain), std::memory_order_relaxed);
  chooseInstructionSet();
  complainOfNames();
  return settings;
}

}  // namespace ode_parallel_sap
