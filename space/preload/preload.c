/* LD_PRELOAD=libode-parallel-sap-preload.so program
 *
 * Stands in front of the functions by which ODE makes its spaces, of those that change geoms
 * without a word to their spaces, and of dCollide. Needs nothing but the C library: a program
 * without ODE gets neither ODE nor anything else into its memory. The library proper is loaded when
 * a program makes its first space, which proves that the program has an ODE. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <ode/ode.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "space/preload/stand_ins.h"

#define PUBLIC __attribute__((visibility("default")))
#define CALLER __builtin_return_address(0)

#if defined(dDOUBLE)
#define PRECISION "double"
#else
#define PRECISION "single"
#endif

/* The kinds of space, by class from dFirstSpaceClass on. */
#define KINDS (dLastSpaceClass - dFirstSpaceClass + 1)
static const char* const kind_names[KINDS] = {"simple", "hash", "sap", "quadtree"};

static pthread_once_t settings = PTHREAD_ONCE_INIT;
static int wanted[KINDS];

/* Accessed atomically. An ODE is known by its type information of dxSpace; there is rarely more
 * than one in a process. */
static unsigned long replaced[KINDS], left[KINDS];
static const void* fitting_ode = NULL;
static const void* refused_ode = NULL;
static const dParallelSAPStandIns* stand_ins = NULL;
static int own_colliders = 0; /* dSetColliderOverride was called */

/* The symbol `name` as the code at `caller` would get it without the preload library: from the
 * objects that every object sees, or else from those that the caller's own object was linked with,
 * which is where a plug-in's ODE is. Null if there is none. `own` is never the answer. */
static void* realSymbol(const char* name, const void* caller, const void* own) {
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

/* The file that an address belongs to. */
static const char* fileOf(const void* address) {
  Dl_info info;
  return dladdr(address, &info) && info.dli_fname ? info.dli_fname : "unknown file";
}

static int printsStats(void) {
  const char* const stats = getenv("ODE_PARALLEL_SAP_STATS"); /* the spaces complain of others */
  return stats && strcmp(stats, "1") == 0;
}

static void report(void) {
  for (int kind = 0; kind < KINDS; ++kind)
    if (replaced[kind] || left[kind])
      fprintf(stderr, "ode-parallel-sap: %lu %s spaces replaced, %lu left\n", replaced[kind],
              kind_names[kind], left[kind]);
  if (stand_ins) stand_ins->report();
}

/* For dl_iterate_phdr: whether an object has functions of ODE or calls them, by the names that it
 * has for the dynamic linker. At the end of a process dlopen would run constructors once more. */
static int knowsODE(struct dl_phdr_info* object, size_t size, void* unused) {
  static const char function[] = "dInitODE2";
  (void)size, (void)unused;
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    if (object->dlpi_phdr[i].p_type != PT_DYNAMIC) continue;
    ElfW(Addr) names = 0, length = 0;
    const ElfW(Dyn)* entry = (const ElfW(Dyn)*)(object->dlpi_addr + object->dlpi_phdr[i].p_vaddr);
    for (; entry->d_tag != DT_NULL; ++entry) {
      if (entry->d_tag == DT_STRTAB) names = entry->d_un.d_ptr;
      if (entry->d_tag == DT_STRSZ) length = entry->d_un.d_val;
    }
    if (names < object->dlpi_addr) names += object->dlpi_addr; /* of the kernel's own object */
    if (memmem((const void*)names, length, function, sizeof function)) return 1;
  }
  return 0;
}

/* For programs whose spaces never came here. */
__attribute__((destructor)) static void reportNone(void) {
  if (!printsStats()) return;
  for (int kind = 0; kind < KINDS; ++kind)
    if (replaced[kind] || left[kind]) return;
  if (dl_iterate_phdr(knowsODE, NULL))
    fprintf(stderr,
            "ode-parallel-sap: no space was made through the dynamic linker. If the program gets "
            "ODE's functions by dlsym (C#, Python's ctypes, JNI), let it call "
            "dParallelSAPSpaceCreate of " ODE_PARALLEL_SAP_LIBRARY "\n");
}

static void readSettings(void) {
  const char* list = getenv("ODE_PARALLEL_SAP_REPLACE");
  if (!list) list = "hash,sap,quadtree";
  while (*list) {
    const size_t length = strcspn(list, ", ");
    int known = length == 0 || (length == 4 && strncmp(list, "none", length) == 0);
    for (int kind = 0; kind < KINDS; ++kind)
      if (strlen(kind_names[kind]) == length && strncmp(list, kind_names[kind], length) == 0)
        wanted[kind] = known = 1;
    if (!known)
      fprintf(stderr,
              "ode-parallel-sap: ODE_PARALLEL_SAP_REPLACE names %.*s, which is no kind of space "
              "(hash, sap, quadtree, simple) and is ignored\n",
              (int)length, list);
    list += length;
    if (*list) ++list;
  }
  if (printsStats()) atexit(report);
}

/* The stand-ins for this ODE, or null and in `why` the reason why there can be none. */
static const dParallelSAPStandIns* load(const void* ode, const void* caller, char* why,
                                        size_t size) {
  int (*const has)(const char*) =
      (int (*)(const char*))realSymbol("dCheckConfiguration", caller, NULL);
  if (!has || !has("ODE_" PRECISION "_precision")) {
    snprintf(why, size, "%s does not have " PRECISION " precision, for which this was built",
             fileOf(ode));
    return NULL;
  }
  void* const library = dlopen(ODE_PARALLEL_SAP_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    snprintf(why, size, "%s", dlerror());
    return NULL;
  }
  const void* const own_ode = dlsym(library, "_ZTI7dxSpace");
  const dParallelSAPStandIns* (*const get)(void) =
      (const dParallelSAPStandIns* (*)(void))dlsym(library, "dParallelSAPGetStandIns");
  const char* misfit = NULL;
  if (own_ode != ode)
    snprintf(why, size, "this was built for %s, the program uses %s", fileOf(own_ode), fileOf(ode));
  else if (!get)
    snprintf(why, size, "%s is of another version", fileOf(dlsym(library, "dSpaceIsParallelSAP")));
  else if ((misfit = get()->misfit()) != NULL)
    snprintf(why, size, "%s differs from the version this was built for: %s", fileOf(ode), misfit);
  else
    return get();
  dlclose(library);
  return NULL;
}

/* The library's stand-ins for the ODE that the caller uses, or null. Takes no lock: the loader has
 * one of its own, which a plug-in's constructors hold when they make a space. */
static const dParallelSAPStandIns* judge(const void* caller) {
  static const char hidden[] = "hidden";
  const void* ode = realSymbol("_ZTI7dxSpace", caller, NULL);
  if (!ode) ode = hidden;
  if (ode == __atomic_load_n(&fitting_ode, __ATOMIC_SEQ_CST))
    return __atomic_load_n(&stand_ins, __ATOMIC_SEQ_CST);
  if (ode == __atomic_load_n(&refused_ode, __ATOMIC_SEQ_CST)) return NULL;

  char why[1024] = "the program's ODE hides what a space is derived from";
  const dParallelSAPStandIns* const verdict =
      ode != hidden ? load(ode, caller, why, sizeof why) : NULL;
  if (!verdict) {
    if (__atomic_exchange_n(&refused_ode, ode, __ATOMIC_SEQ_CST) != ode)
      fprintf(stderr, "ode-parallel-sap: nothing is replaced: %s\n", why);
    return NULL;
  }
  dParallelSAPCollideFunction* const collide =
      (dParallelSAPCollideFunction*)realSymbol("dCollide", caller, (const void*)&dCollide);
  if (collide) verdict->set_collide(collide); /* before another thread can have a space */
  __atomic_store_n(&stand_ins, verdict, __ATOMIC_SEQ_CST);
  __atomic_store_n(&fitting_ode, ode, __ATOMIC_SEQ_CST);
  if (!collide || __atomic_load_n(&own_colliders, __ATOMIC_SEQ_CST)) verdict->stop_contacts();
  return verdict;
}

/* The space that takes the place of a stock space of this class; null: it is left to ODE. */
static dSpaceID create(dSpaceID parent, int space_class, const void* caller) {
  const int kind = space_class - dFirstSpaceClass;
  pthread_once(&settings, readSettings);
  const dParallelSAPStandIns* const use = wanted[kind] ? judge(caller) : NULL;
  __atomic_fetch_add(use ? &replaced[kind] : &left[kind], 1, __ATOMIC_RELAXED);
  return use ? use->create(parent, space_class) : NULL;
}

/* The function `name` as `caller` would get it. To ask the dynamic linker takes longer than many a
 * collision, so the answer is kept: for all where every object sees the same ODE, else for the last
 * callers. The ODE that it is in stays loaded from then on. */
static void* originalOf(const char* name, const void* caller, const void* own, void** of_all) {
  enum { callers = 16 };
  static __thread struct {
    const void *caller, *own;
    void* original;
  } kept[callers];

  void* original = __atomic_load_n(of_all, __ATOMIC_RELAXED);
  if (original) return original;
  const size_t place = (size_t)caller / 4 % callers;
  if (kept[place].caller == caller && kept[place].own == own) return kept[place].original;
  original = realSymbol(name, caller, own);
  if (!original) {
    fprintf(stderr, "ode-parallel-sap: %s is called, but no ODE that has it is found\n", name);
    abort();
  }
  if (!dlopen(fileOf(original), RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE)) return original;
  if (dlsym(RTLD_NEXT, name)) {
    __atomic_store_n(of_all, original, __ATOMIC_RELAXED);
  } else {
    kept[place].caller = caller;
    kept[place].own = own;
    kept[place].original = original;
  }
  return original;
}

#define ORIGINAL(function)                                                                 \
  __extension__({                                                                          \
    static void* of_all = NULL;                                                            \
    (__typeof__(&function))originalOf(#function, CALLER, (const void*)&function, &of_all); \
  })

/* A function that makes a stock space. */
#define MAKES(space_class, function, declared, passed)          \
  PUBLIC dSpaceID function declared {                           \
    const dSpaceID space = create(parent, space_class, CALLER); \
    return space ? space : ORIGINAL(function) passed;           \
  }

MAKES(dSimpleSpaceClass, dSimpleSpaceCreate, (dSpaceID parent), (parent))
MAKES(dHashSpaceClass, dHashSpaceCreate, (dSpaceID parent), (parent))
MAKES(dSweepAndPruneSpaceClass, dSweepAndPruneSpaceCreate, (dSpaceID parent, int axis_order),
      (parent, axis_order))
MAKES(dQuadTreeSpaceClass, dQuadTreeSpaceCreate,
      (dSpaceID parent, const dVector3 center, const dVector3 extents, int depth),
      (parent, center, extents, depth))

/* Contacts that are known need no ODE. */
PUBLIC int dCollide(dGeomID o1, dGeomID o2, int flags, dContactGeom* contact, int skip) {
  const dParallelSAPStandIns* const use = __atomic_load_n(&stand_ins, __ATOMIC_ACQUIRE);
  const int count = use ? use->collide(o1, o2, flags, contact, skip) : -1;
  if (count >= 0) return count;
  return ORIGINAL(dCollide)(o1, o2, flags, contact, skip);
}

/* The program's own colliders may be anything. */
PUBLIC void dSetColliderOverride(int i, int j, dColliderFn* fn) {
  __atomic_store_n(&own_colliders, 1, __ATOMIC_SEQ_CST);
  const dParallelSAPStandIns* const use = __atomic_load_n(&stand_ins, __ATOMIC_SEQ_CST);
  if (use) use->stop_contacts();
  ORIGINAL(dSetColliderOverride)(i, j, fn);
}

/* What ODE does not tell spaces of. Told before the call, while a body still has its geoms. */
#define CHANGES(geom, body, function, declared, passed)                                    \
  PUBLIC void function declared {                                                          \
    const dParallelSAPStandIns* const use = __atomic_load_n(&stand_ins, __ATOMIC_ACQUIRE); \
    if (use) use->changed(geom, body);                                                     \
    ORIGINAL(function) passed;                                                             \
  }

CHANGES(geom, NULL, dGeomSetCategoryBits, (dGeomID geom, unsigned long bits), (geom, bits))
CHANGES(geom, NULL, dGeomSetCollideBits, (dGeomID geom, unsigned long bits), (geom, bits))
CHANGES(geom, NULL, dGeomEnable, (dGeomID geom), (geom))
CHANGES(geom, NULL, dGeomDisable, (dGeomID geom), (geom))
CHANGES(geom, NULL, dGeomSetBody, (dGeomID geom, dBodyID body), (geom, body))
CHANGES(NULL, body, dBodyEnable, (dBodyID body), (body))
CHANGES(NULL, body, dBodyDestroy, (dBodyID body), (body))
CHANGES(NULL, body, dBodySetAutoDisableFlag, (dBodyID body, int flag), (body, flag))
CHANGES(NULL, body, dBodySetAutoDisableDefaults, (dBodyID body), (body))
CHANGES(NULL, NULL, dWorldDestroy, (dWorldID world), (world))
