// A collector as ITT loads it (INTEL_LIBITTNOTIFY64): says on stderr which tasks begin and end.
#include <ittnotify.h>

#include <cstdio>

// Domains and names are those of the static library. In the header these are macros that go by way
// of a table.
#undef __itt_task_begin
#undef __itt_task_end
#undef __itt_api_version

#define EXPORTED extern "C" __attribute__((visibility("default")))

EXPORTED const char* __itt_api_version() {
  return "3";
}

EXPORTED void __itt_task_begin(const __itt_domain* domain, __itt_id, __itt_id,
                               __itt_string_handle* name) {
  static bool named = false;
  if (!named) std::fprintf(stderr, "domain %s\n", domain->nameA);
  named = true;
  std::fprintf(stderr, "+ %s\n", name->strA);
}

EXPORTED void __itt_task_end(const __itt_domain*) {
  std::fprintf(stderr, "-\n");
}
