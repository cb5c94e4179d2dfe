#include "space/base/platform.h"

#if defined(_WIN32)
#include <stdlib.h>
#include <windows.h>
#else
#include <pthread.h>
#include <unistd.h>
#endif
#if defined(__linux__)
#include <sys/resource.h>
#include <sys/syscall.h>
#elif defined(__APPLE__)
#include <crt_externs.h>
#include <mach/mach.h>
#endif

#include <chrono>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

namespace ode_parallel_sap {

#if defined(_WIN32)
std::uint64_t freeMemory() {
  MEMORYSTATUSEX status;
  status.dwLength = sizeof status;
  return GlobalMemoryStatusEx(&status) ? status.ullAvailPhys : 0;
}

void onFork(void (*)(), void (*)(), void (*)()) {}

long processNumber() {
  return static_cast<long>(GetCurrentProcessId());
}
#else
void onFork(void (*before)(), void (*in_parent)(), void (*in_child)()) {
  pthread_atfork(before, in_parent, in_child);
}

long processNumber() {
  return getpid();
}
#endif

char** environment() {
#if defined(_WIN32)
  return _environ;
#elif defined(__APPLE__)
  return *_NSGetEnviron();
#else
  return environ;
#endif
}

#if defined(__APPLE__)
std::uint64_t freeMemory() {
  vm_statistics64_data_t pages;
  mach_msg_type_number_t count = HOST_VM_INFO64_COUNT;
  if (host_statistics64(mach_host_self(), HOST_VM_INFO64, reinterpret_cast<host_info64_t>(&pages),
                        &count) != KERN_SUCCESS)
    return 0;
  return (std::uint64_t{pages.free_count} + pages.inactive_count) * vm_page_size;
}
#elif !defined(_WIN32)
std::uint64_t freeMemory() {
  std::ifstream file("/proc/meminfo");
  std::uint64_t kilobytes = 0;
  for (std::string name; file >> name;)
    if (name == "MemAvailable:") file >> kilobytes;
  return kilobytes * 1024;
}
#endif

#if defined(__linux__)
std::uint64_t freeAddressSpace() {
  rlimit limit;
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return std::numeric_limits<std::uint64_t>::max();
  unsigned long long pages = 0;
  if (std::FILE* const file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  const std::uint64_t used = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

long threadNumber() {
  return syscall(SYS_gettid);
}

void awaitRemoval(long thread) {
  const auto latest = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
  while (syscall(SYS_tgkill, getpid(), thread, 0) == 0 && std::chrono::steady_clock::now() < latest)
    std::this_thread::yield();
}
#else
std::uint64_t freeAddressSpace() {
  return std::numeric_limits<std::uint64_t>::max();
}

long threadNumber() {
  return 0;
}

void awaitRemoval(long) {}
#endif

}  // namespace ode_parallel_sap
