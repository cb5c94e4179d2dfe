#include "space/data/free_memory.h"

#include <unistd.h>

#include <cstdio>

namespace ode_parallel_sap {

std::uint64_t freeMemory() {
  if (std::FILE* const file = std::fopen("/proc/meminfo", "r")) {
    char line[256];
    unsigned long long kilobytes = 0;
    bool told = false;
    while (!told && std::fgets(line, sizeof line, file))
      told = std::sscanf(line, "MemAvailable: %llu kB", &kilobytes) == 1;
    std::fclose(file);
    if (told) return std::uint64_t{kilobytes} * 1024;
  }
  const long pages = sysconf(_SC_AVPHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  return pages > 0 && page_bytes > 0 ? std::uint64_t(pages) * std::uint64_t(page_bytes) : 0;
}

}  // namespace ode_parallel_sap
