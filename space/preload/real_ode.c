#define _GNU_SOURCE
#include "space/preload/real_ode.h"

#include <dlfcn.h>
#include <link.h>
#include <stddef.h>

void* realSymbol(const char* name, const void* caller, const void* own) {
  void* symbol = dlsym(RTLD_NEXT, name);
  if (symbol) return symbol;

  Dl_info info;
  struct link_map* object = NULL;
  if (!dladdr1(caller, &info, (void**)&object, RTLD_DL_LINKMAP) || !object) return NULL;
  void* const scope = dlopen(object->l_name, RTLD_LAZY | RTLD_NOLOAD);
  if (!scope) return NULL;
  symbol = dlsym(scope, name);
  dlclose(scope);
  return symbol == own ? NULL : symbol;
}

const char* fileOf(const void* address) {
  Dl_info info;
  return dladdr(address, &info) && info.dli_fname ? info.dli_fname : "unknown file";
}
