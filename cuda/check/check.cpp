// Checks the CUDA sweep against the CPU's and times it, on plain boxes.
#include "cuda/check/check.h"

#include <omp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

bool checkAllFaults(int threads) {
  using namespace cuda_check;
  return checkFaults(threads, 1) && checkFaults(threads, 1, true) && checkFaults(threads, 2) &&
         checkFaults(threads, 2, true) && checkSharing(threads) && checkLocks(threads);
}

}  // namespace

int main(int count, char** arguments) {
  using namespace cuda_check;
  const char* const what = count > 1 ? arguments[1] : "all";
  const int threads = count > 2 ? std::atoi(arguments[2]) : omp_get_max_threads();
  const int devices = count > 3 ? std::atoi(arguments[3]) : 4;
  std::string why;
  if (ode_parallel_sap::cudaDevices(&why).empty()) {
    std::printf("skipped: %s\n", why.c_str());
    return 77;
  }
  bool good = true;
  if (!std::strcmp(what, "small")) {
    good = compareAll(5000, threads, devices) && checkAxisLists(2000, threads);
  } else if (!std::strcmp(what, "tiny")) {
    // Few enough for compute-sanitizer; its slowest tool wants a process for each scene.
    const std::size_t most = count > 4 ? std::strtoull(arguments[4], nullptr, 10) : 1234;
    const std::string scene = count > 5 ? arguments[5] : "";
    good = (scene == "axis lists" || compareAll(most, threads, devices, scene)) &&
           (!(scene.empty() || scene == "axis lists") ||
            checkAxisLists(std::min<std::size_t>(most, 300), threads));
  } else if (!std::strcmp(what, "compare")) {
    good = compareAll(1000000, threads, devices);
  } else if (!std::strcmp(what, "faults")) {
    good = checkAllFaults(threads);
  } else if (!std::strcmp(what, "axis")) {
    good = checkAxisLists(20000, threads);
    timeAxisLists(threads);
  } else if (!std::strcmp(what, "devices")) {
    good = timeDevices(count > 4 ? std::strtoull(arguments[4], nullptr, 10) : 16000000, threads,
                       devices);
  } else if (!std::strcmp(what, "csv") && count > 5) {
    good = recordTimes(arguments[5], std::strtoull(arguments[4], nullptr, 10), threads, devices);
  } else if (!std::strcmp(what, "quick")) {
    good = timeAll(true, threads);
  } else if (!std::strcmp(what, "time")) {
    good = timeAll(false, threads);
  } else if (!std::strcmp(what, "profile") && count > 4) {
    profile(arguments[3], std::strtoull(arguments[4], nullptr, 10), threads);
  } else if (!std::strcmp(what, "all")) {
    good = compareAll(1000000, threads, devices) && checkAllFaults(threads) &&
           checkAxisLists(20000, threads) && timeAll(false, threads);
  } else {
    std::printf(
        "usage: %s [all|compare|small|tiny|faults|axis|quick|time] [threads] [devices]\n"
        "       %s tiny <threads> <devices> <most boxes> [scene|\"axis lists\"]\n"
        "       %s devices <threads> <devices> <most boxes>\n"
        "       %s csv <threads> <devices> <most boxes> <file>\n"
        "       %s profile <threads> <scene> <boxes>\n",
        arguments[0], arguments[0], arguments[0], arguments[0], arguments[0]);
    return 2;
  }
  std::printf(good ? "all good\n" : "FAILED\n");
  return good ? 0 : 1;
}
