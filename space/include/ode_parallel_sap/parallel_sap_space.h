/* dParallelSAPSpace: an exact, deterministic, parallel broad phase for the Open Dynamics Engine.
 *
 *     dSpaceID space = dParallelSAPSpaceCreate (0);      // instead of dHashSpaceCreate (0)
 *
 * ODE's functions for any space take this one, too. With all methods, back ends and threads:
 *
 * - Pairs: those of dSimpleSpace, each once. Two geoms are a pair if their bounding boxes (AABBs)
 *   overlap as closed intervals in dReal, a category bit of one is a collide bit of the other, they
 *   are not both on one body, both AABBTest calls pass, both are enabled and neither is zero-sized.
 *   Only settings off by default change that. A sub-space empty at any depth is in no pair.
 * - Order: ascending by (earlier geom, later geom), counted by when each was last added to the
 *   space. The earlier geom is the callback's first argument. dSpaceCollide2 visits the geoms of
 *   this space in that order and keeps ODE's order of arguments. As in ODE, the geom that it is
 *   called with need not be enabled, and may be zero-sized.
 * - Callbacks run on the calling thread, unless they say otherwise, with the space locked, and may
 *   collide any space. A throw unlocks it. A longjmp does not, as in ODE: pairs stay right, events
 *   resume with the next call no deeper on the stack. Bits, bodies, enabled states count from later
 *   calls on. Geoms may be destroyed and, if ODE has no assertions, removed, added and moved: what
 *   left is in no further report of a running call, even if it came back (to a stock sub-space, it
 *   may be); what came is in calls that begin later. Not so in dSpaceCollide2 of two spaces.
 * - A geom with a NaN bound is in no pair; dMessage reports it once, the statistics count it. Other
 *   bounds (infinite, inverted, denormal, huge) follow the rule above in any floating-point mode.
 * - AABB and AABBTest functions of user classes run on the calling thread, with the space locked,
 *   before the first report. They must not change a geom of the space nor collide it.
 * - Contacts are dCollide's, bit for bit, in the order of the pairs, on any thread and ODE build.
 * - Time is linear, except with BruteForce and AxisLists. No frame takes more than twice as long as
 *   in a new space, plus allocations. A frame waits for no thread that has not begun its work.
 * - A missing thread, GPU or memory costs time, never pairs. dDebug ends the program only if what
 *   one pair, ray or probe finds has no memory. Where all pairs have none, enabling acts at once.
 *
 * Threads: different spaces may be used by different threads at once, one space by one at a time,
 * which debug builds assert and others report once. dSpaceCollide2 with a geom also uses the space
 * of that geom. While nothing changes, any number of threads may call dSpaceCollide2 (geom, space),
 * dParallelSAPSpaceRays, -RayHits and -Overlaps, from concurrent blocks too: no geom of these
 * spaces and their sub-spaces is moved, added, removed or changed, and no sub-space has swept
 * bounds. Threads must not share probes, nor heightfield data, to which ODE's colliders write.
 *
 * Errors: a wrong argument fails an assertion, as in ODE: dDebug names the function. Later versions
 * may add fields at the end of the structs of statistics, contact callbacks, rays, hits and probes;
 * each call passes their size. All other structs stay as they are. */
#ifndef ODE_PARALLEL_SAP_PARALLEL_SAP_SPACE_H
#define ODE_PARALLEL_SAP_PARALLEL_SAP_SPACE_H
#include <stddef.h>

#include "ode/ode.h" /* a fork with another path gets a header of this name beside this one */

#if !defined(_WIN32) && defined(__GNUC__)
#define ODE_PARALLEL_SAP_API __attribute__((visibility("default")))
#elif !defined(_WIN32) || !defined(ODE_PARALLEL_SAP_SHARED) /* CMake defines it for a DLL */
#define ODE_PARALLEL_SAP_API
#elif defined(ODE_PARALLEL_SAP_BUILD)
#define ODE_PARALLEL_SAP_API __declspec(dllexport)
#else
#define ODE_PARALLEL_SAP_API __declspec(dllimport)
#endif
#ifdef __cplusplus
extern "C" {
#endif
/* Creates the space, inside `parent` if that is not 0. dSpaceDestroy destroys it, and its geoms
 * unless dSpaceSetCleanup (space, 0) was called. */
ODE_PARALLEL_SAP_API dSpaceID dParallelSAPSpaceCreate(dSpaceID parent);

/* 1 if dParallelSAPSpaceCreate made the space, else 0. */
ODE_PARALLEL_SAP_API int dSpaceIsParallelSAP(dSpaceID space);

/* Declares, to the end of the process, that a class of dCreateGeomClass has no AABBTest. */
ODE_PARALLEL_SAP_API void dParallelSAPClassHasNoAABBTest(int geom_class);

/* Where pairs are found. Auto sends each frame to the CPU or GPUs, by past times, and loads the
 * driver once GPUs could have saved 50 ms. Setting CUDA loads it, and a thread makes a GPU ready in
 * up to 1 s, for which frames wait; it runs AxisLists, and Sweep if floats suffice. dMessage
 * reports a GPU that fails; full, or reset, it is tried again. A forked child uses the CPU. */
enum { dParallelSAPBackendAuto, dParallelSAPBackendCPU, dParallelSAPBackendCUDA };
/* Returns 1, or 0 and changes nothing if build or machine lack the back end. Default: Auto. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetBackend(dSpaceID space, int backend);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetBackend(dSpaceID space);

/* How pairs are found. AxisLists, for comparison, is section 5.1 of Avril, Gouranton and Arnaldi,
 * "Collision Detection: Broad Phase Adaptation from Multi-Core to Multi-GPU Architecture". If its
 * lists need more than half of the free memory, dMessage says so once and Sweep is used. */
enum {
  dParallelSAPMethodAuto,       /* the fastest one for the scene */
  dParallelSAPMethodSweep,      /* subdivided sweep and prune: time linear in geoms and pairs */
  dParallelSAPMethodBruteForce, /* all (n*n-n)/2 pairs, in equal parts a thread */
  dParallelSAPMethodAxisLists   /* the pairs of each axis as lists, then their intersection */
};
/* Returns 1, or 0 and changes nothing if there is no such method. Default: Auto. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetMethod(dSpaceID space, int method);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetMethod(dSpaceID space);

/* The most threads of a collide, 1 to 256; larger numbers count as 256. 0, the default, is OpenMP's
 * number (affinity, OMP_NUM_THREADS). The first large collide starts them; all spaces share them.
 * Small scenes use one thread, and a forked child whose parent had started threads. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNumThreads(dSpaceID space, int n);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNumThreads(dSpaceID space);

/* The most GPUs that share a frame. 0, the default: by the times of the last frames. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNumDevices(dSpaceID space, int n);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNumDevices(dSpaceID space);

/* Nonzero: a plane and a geom whose AABB is wholly on its open side are no pair. No pair with a
 * contact is left out. Default: 0, as in ODE's spaces. Holds for dSpaceCollide2 too. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetCullPlanes(dSpaceID space, int cull);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetCullPlanes(dSpaceID space);

/* Called on the calling thread for each pair that touches, in the order of the pairs, with the
 * space locked. `contacts` last until it returns, `count` >= 1. It may throw and collide. */
typedef void dParallelSAPContactCallback(void* data, dGeomID o1, dGeomID o2,
                                         const dContactGeom* contacts, int count);

/* Returns the flags of dCollide for a pair: the most contacts in the lower 16 bits (0: the pair is
 * left out), CONTACTS_UNIMPORTANT, dParallelSAPOnCallingThread. Other bits are an error. IT IS
 * CALLED FROM MANY THREADS AT ONCE, in no order. It may read geoms, bodies and joints, as
 * dAreConnectedExcluding does, but do nothing else with ODE, and not write what another thread may
 * read. If it throws, but for bad_alloc, one exception leaves the call without any report. */
typedef int dParallelSAPFlagsCallback(void* data, dGeomID o1, dGeomID o2);

/* Called after dCollide for each pair that touches. It may change and reorder the contacts, and
 * returns how many remain, from the first on. CALLED FROM MANY THREADS, like the flags callback. */
typedef int dParallelSAPReduceCallback(void* data, dGeomID o1, dGeomID o2, dContactGeom* contacts,
                                       int count);

/* For reduce callbacks, on any thread: `return dParallelSAPKeepSpread (contacts, count, 4);`. They
 * move the best contacts to the front and return their number, up to `most`. Those beside an AABB
 * of their geoms come last, those without a normal or with a NaN never. KeepDeepest keeps the
 * deepest first. KeepSpread keeps the deepest, the farthest from it, then always the one that adds
 * most area to the hull along the first one's normal, or the deepest. The rest, and equals, keep
 * their order. */
ODE_PARALLEL_SAP_API int dParallelSAPKeepDeepest(dContactGeom* contacts, int count, int most);
ODE_PARALLEL_SAP_API int dParallelSAPKeepSpread(dContactGeom* contacts, int count, int most);

/* Called on the calling thread for each pair with a space in it, in order. It adds pairs instead,
 * mostly by dSpaceCollide2 (o1, o2, pairs, dParallelSAPAddPair), and changes no geom. */
typedef void dParallelSAPSpacesCallback(void* data, dGeomID o1, dGeomID o2, void* pairs);

/* Adds a pair to the `pairs` of a running dParallelSAPSpacesCallback. It is a dNearCallback. */
ODE_PARALLEL_SAP_API void dParallelSAPAddPair(void* pairs, dGeomID o1, dGeomID o2);

/* The callbacks of dParallelSAPSpaceCollideContacts. */
typedef struct dParallelSAPContactCallbacks {
  dParallelSAPContactCallback* contacts; /* must be there; the others may be 0 */
  dParallelSAPFlagsCallback* flags;      /* 0: the same flags for all pairs */
  dParallelSAPReduceCallback* reduce;    /* 0: all contacts are kept */
  dParallelSAPSpacesCallback* spaces;    /* 0: dSpaceCollide2, down to pairs of geoms */
} dParallelSAPContactCallbacks;
/* `dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf (makeJoints);` */
#define dParallelSAPContactCallbacksOf(contacts) \
  { (contacts), NULL, NULL, NULL }
enum { dParallelSAPOnCallingThread = 0x40000000 }; /* flag: dCollide on the calling thread, alone */

/* The narrow phase on the threads of the space: finds the pairs of dSpaceCollide, calls dCollide
 * with these flags, or those of the flags callback, and reports the contacts. `data` goes to all
 * callbacks. All pairs are collided before the first report. `flags` must ask for 1 contact or
 * more, unless there is a flags callback. Without memory for all contacts, or if a flags callback
 * throws bad_alloc, pairs are collided one by one; flags and reduce callbacks may be called again.
 *
 * The calling thread needs ODE's data, as for dCollide (dAllocateODEDataForThread); others allocate
 * theirs, and free them at the end if dSpaceSetManualCleanup is set. Which thread collides:
 *
 * - Any: spheres, boxes, capsules, cylinders, convexes, planes, rays and OPCODE's meshes.
 * - Any, in an image: heightfields, and meshes if dCheckConfiguration ("ODE_EXT_mt_collisions") is
 *   0. An image is ODE's library, loaded again (2 MB). If that fails, dMessage says why, and the
 *   calling thread collides these pairs. Calling threads take turns at meshes.
 * - The calling one, alone: geom transforms, user classes, meshes of GIMPACT or with callbacks or
 *   temporal coherence, heightfields with callbacks, meshes with heightfields if the above is 1,
 *   colliders of dSetColliderOverride if the pair needs an image, and dParallelSAPOnCallingThread.
 *   Other overridden colliders run on any thread, and not for most boxes that are apart. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollideContacts(
    dSpaceID space, void* data, int flags, const dParallelSAPContactCallbacks* callbacks);

/* A pair of dParallelSAPSpaceCollidePairs. */
typedef struct dParallelSAPPair {
  dGeomID o1, o2; /* as the near callback gets them */
} dParallelSAPPair;
/* A block of the frame's pairs, in their order: `first` is the place of pairs[0] in the frame.
 * `count` is 1 or more: the same up to the last, if no geom leaves. `pairs` last until it ends. */
typedef void dParallelSAPPairsCallback(void* data, const dParallelSAPPair* pairs, size_t count,
                                       size_t first);
enum { dParallelSAPPairsConcurrent = 1 }; /* flag: blocks go to many threads at once, unordered */

/* Finds the pairs of dSpaceCollide and hands them out in blocks of some hundred. With `callback` 0,
 * pairs are only found and counted, for programs that use begun and ended pairs.
 * Threads: without flags, blocks come in order on the calling thread, under the rules of near
 * callbacks. With dParallelSAPPairsConcurrent THE CALLBACK IS CALLED FROM MANY THREADS AT ONCE, in
 * the caller's floating-point mode (on x86 that of SSE; x87's is the thread's own). It may read
 * geoms and bodies, write what belongs to its pairs alone, and collide other spaces that no other
 * thread uses. For dCollide it must allocate its thread's data, and know which geoms other threads
 * collide. If it throws, no further block begins, and one exception leaves this call. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollidePairs(dSpaceID space, void* data, int flags,
                                                        dParallelSAPPairsCallback* callback);

/* A ray of dParallelSAPSpaceRays. */
typedef struct dParallelSAPRay {
  dVector3 origin;                           /* where it begins */
  dVector3 direction;                        /* of any length but 0: dGeomRaySet makes it 1 */
  dReal length;                              /* 0 or more */
  unsigned long category_bits, collide_bits; /* as a geom's. If both are 0, the ray has all bits */
  dBodyID ignore;                            /* the ray passes its geoms; 0: none */
} dParallelSAPRay;

/* Where a ray hits a geom. */
typedef struct dParallelSAPRayHit {
  dGeomID geom;         /* 0: the ray hits nothing */
  dReal distance;       /* from the origin: the depth of the contact of dCollide (ray, geom, ...) */
  dVector3 pos, normal; /* of this contact */
  int side;             /* of the geom in this contact (side2): a mesh's triangle, or -1 */
} dParallelSAPRayHit;
/* As dGeomRaySetFirstContact, -BackfaceCull and -ClosestHit. FirstContact makes "nearest" any hit
 * of a mesh, maybe its far side, even with ClosestHit. Lower 16 bits: the most hits of a ray with
 * one geom, the nearest ones; 0: one. */
enum {
  dParallelSAPRayFirstContact = 0x10000,
  dParallelSAPRayBackfaceCull = 0x20000,
  dParallelSAPRayClosestHit = 0x40000
};
/* Writes the nearest hit of rays[i] to nearest[i], and returns the number of rays with a hit. A
 * hit is, bit for bit, the nearest of all contacts that dCollide finds with the geoms that
 * dSpaceCollide2 reports for the ray, in sub-spaces too. Meshes without callbacks are asked for
 * the closest hit alone. ODE finds hits on heightfields in no order: to find all takes 3 % more
 * time. A heightfield's contact that is not on the ray, which ODE makes if all ground near it is
 * higher, is no hit. Settings for pairs have no effect. A ray hits nothing if its origin or
 * direction is not finite, its direction 0, or its length negative or NaN. The space keeps trees
 * over the geoms while rays come, if memory allows.
 * Threads: as in dParallelSAPSpaceCollideContacts. Overridden colliders of rays with spheres,
 * boxes, capsules and cylinders may run on any thread, and only if the ray meets the geom's AABB.
 * Order: of hits at one distance, the first one of the geom added earlier counts. The geoms of a
 * sub-space have its place, and among each other the order of dSpaceGetGeom, but in a
 * dSweepAndPruneSpace or dQuadTreeSpace the one added last comes first. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRays(dSpaceID space, const dParallelSAPRay* rays,
                                                  size_t count, int flags,
                                                  dParallelSAPRayHit* nearest);

/* Gets rays[ray]'s hits while it runs, the nearest first. It may do what near callbacks may. */
typedef void dParallelSAPRayCallback(void* data, size_t ray, const dParallelSAPRayHit* hits,
                                     size_t count);
/* All hits. When all have been found, calls the callback for each ray that has any, in the order of
 * the rays, on the calling thread, with the space locked. Returns the number of hits. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRayHits(dSpaceID space, const dParallelSAPRay* rays,
                                                     size_t count, int flags, void* data,
                                                     dParallelSAPRayCallback* callback);

/* A probe of dParallelSAPSpaceOverlaps. */
typedef struct dParallelSAPProbe {
  dGeomID geom;   /* in any space or none; itself no space, and in no other probe */
  dBodyID ignore; /* the probe passes its geoms; 0: none */
  size_t touched; /* is written: the number of geoms that it touches */
} dParallelSAPProbe;
enum { dParallelSAPOverlapAny = 0x10000 }; /* flag: `touched` is 1 or 0, and no callback */

/* Gets the contacts of a probe and one geom, as dCollide (probe, geom) finds them. */
typedef void dParallelSAPOverlapCallback(void* data, size_t probe, dGeomID geom,
                                         const dContactGeom* contacts, int count);

/* The geoms that dSpaceCollide2 (probe, space) reports, in sub-spaces too, and dCollide (probe,
 * geom, flags) finds contacts of, bit for bit. `flags` 0: one contact a geom. When all have been
 * found, calls the callback, which may be 0, for each of them, in the order of the probes and then
 * of the geoms (in sub-spaces as of rays), on the calling thread, with the space locked. It may do
 * what near callbacks may, but not change probes. Returns the sum of all `touched`. `size` is
 * sizeof (dParallelSAPProbe). Threads: as in dParallelSAPSpaceCollideContacts. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceOverlaps(dSpaceID space, dParallelSAPProbe* probes,
                                                      size_t count, size_t size, int flags,
                                                      void* data,
                                                      dParallelSAPOverlapCallback* callback);

/* Whether a query, rays[query] or probes[query], may meet a geom; 0: it passes the geom. IT IS
 * CALLED FROM MANY THREADS AT ONCE, in no order, under the rules of flags callbacks. */
typedef int dParallelSAPQueryFilter(void* data, size_t query, dGeomID geom);
/* Rays, RayHits and Overlaps call the filter, before dCollide, for the geoms whose AABB overlaps
 * the query's: those of sub-spaces too, but no space. They may call it again for the same geom.
 * Filters of sub-spaces have no effect. Default: 0, none. Not while other threads query the space.
 * If the filter throws, one exception leaves the query's call, without any report. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetQueryFilter(dSpaceID space,
                                                          dParallelSAPQueryFilter* filter,
                                                          void* data);

/* Events: what began and what ended since the collide before.
 *
 * - Pairs: of any collide but dSpaceCollide2. The first collide begins all its pairs.
 * - Touches: geoms whose contacts go to the contact callback of dParallelSAPSpaceCollideContacts.
 *   A touch ends if a later such collide reports no contacts of it: ODE finds none, the flags are
 *   0, the reduce callback leaves none, or a geom is disabled or left. Collides by other calls
 *   change no touch, and asking for touches after one says so once.
 * - A pair that SetSkipStatic or SetSkipAsleep leaves out does not end, nor does its touch, while
 *   both geoms stay, are enabled, and their bits and AABBs still match.
 * - A geom that is removed and added again ends its pairs and touches, and begins them.
 * - Touches of geoms in sub-spaces are told, too, but pairs are those of the space itself. A geom
 *   keeps touches if its sub-space leaves and comes back between two collides, or if it leaves a
 *   stock one and comes back.
 *
 * Pairs' events are known before the first report, touches' events before the first contact
 * callback. Both stay until the next collide. A collide within a callback of this space, or without
 * memory, has none, nor has one whose flags or reduce callback throws touches': a later one reports
 * its changes. `events` is a sum of the bits below, 0 by default; GetEvents returns it. */
enum { dParallelSAPEventPairs = 1, dParallelSAPEventTouches = 2 };
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetEvents(dSpaceID space, int events);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetEvents(dSpaceID space);

/* A pair or touch that began or ended. A begun pair gets the lowest free number, in the order of
 * the pairs, and keeps it up to its ended event; the next collide may use it. Numbers can index an
 * array. A touch has the number of its pair, a touch in sub-spaces one of its own. */
typedef struct dParallelSAPPairEvent {
  dGeomID o1, o2;  /* as reported; of what ended, 0 if it has left its space: it may not exist */
  size_t place;    /* among the collide's pairs; of an ended one, in the last collide that had it;
                      of a touch in sub-spaces, the place of the pair of these */
  unsigned number; /* as long as it lasts */
} dParallelSAPPairEvent;
/* The pairs that began, by place. Sets *pairs to the first, or to 0 if there is none, and returns
 * their number. They belong to the space and stay until its next collide. If these events are off,
 * dMessage says so once. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetBegunPairs(dSpaceID space,
                                                           const dParallelSAPPairEvent** pairs);
/* Likewise the pairs that ended, by place. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetEndedPairs(dSpaceID space,
                                                           const dParallelSAPPairEvent** pairs);
/* Likewise the touches. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetBegunTouches(dSpaceID space,
                                                             const dParallelSAPPairEvent** touches);
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetEndedTouches(dSpaceID space,
                                                             const dParallelSAPPairEvent** touches);
/* Likewise the numbers of all pairs of the last collide, by place. Many threads may read them. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetPairNumbers(dSpaceID space,
                                                            const unsigned** numbers);

/* Finds a pair of the last collide, in any order: 1 and *number, or 0. Many threads may do so. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceFindPair(dSpaceID space, dGeomID o1, dGeomID o2,
                                                   unsigned* number);

/* Nonzero: pairs at rest are left out, except in dSpaceCollide2. A static pair has no body. A pair
 * asleep has one body or two, all disabled. A body that is enabled in any way has its pairs in the
 * next collide. Default: 0, as in ODE. Pairs of sub-spaces are never at rest. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSkipStatic(dSpaceID space, int skip);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetSkipStatic(dSpaceID space);
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSkipAsleep(dSpaceID space, int skip);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetSkipAsleep(dSpaceID space);

/* Nonzero: the program promises to call dParallelSAPSpaceNotify, before the next collide, for
 * changes that ODE does not announce. Frames then read no geom for these. Default: 0. Changes are:
 * a geom gets other category or collide bits, is enabled or disabled, or loses its body
 * (dGeomSetBody (geom, 0), dBodyDestroy, dWorldDestroy). Under SetSkipAsleep, calls that wake its
 * body count (dBodyEnable, dBodySetAutoDisableFlag, -Defaults), steps do not. A missing call may
 * cost or add pairs; ODE_PARALLEL_SAP_NOTIFIED=check finds it. No effect up to 120 geoms. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNotified(dSpaceID space, int notified);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNotified(dSpaceID space);
/* Notifies the space of a change of a geom of it, or, with `geom` 0, of any of its geoms. Allowed
 * in callbacks, and for geoms from many threads at once while nothing else uses the space. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceNotify(dSpaceID space, dGeomID geom);

/* A finite length, 0 or more: AABBs up to this far apart on each axis may be a pair, except in
 * dSpaceCollide2. No overlap is missed. Default: 0. It saves time if geoms move by less than 1/5 of
 * it a frame and lie within 2^18 tolerances of the origin. All runs have the same extra pairs. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetTolerance(dSpaceID space, dReal distance);
ODE_PARALLEL_SAP_API dReal dParallelSAPSpaceGetTolerance(dSpaceID space);

/* A trace: every `every`-th collide, not dSpaceCollide2, writes the space's geoms and number of
 * pairs to the file `path`, to be replayed without the program (space/trace in the sources).
 * Returns 1, or 0 if the file cannot be made. Each call ends the trace before it; `path` 0 does
 * only that. If writing fails, dMessage says so once. GetTrace returns `every`, or 0. Collides in
 * callbacks and forked children write none. Not while the space is locked. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetTrace(dSpaceID space, const char* path, int every);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetTrace(dSpaceID space);

/* Seconds, 0 or more, finite: each AABB covers its geom's motion in a coming step of that length,
 * so that pairs of fast bodies come in time. Default: 0. Pairs, queries and rays use these
 * boxes. They are, in dReal, with an enabled body's velocities when the collide begins,
 *     [lower + min (d, 0) - a * r, upper + max (d, 0) + a * r], d = linear velocity * step,
 *     a = the lesser of |angular velocity| * step and 2 (a NaN counts as 0),
 *     r = distance from the body's position to the AABB's farthest corner, or to a sphere's centre.
 * Forces are not covered. A sub-space has a step of its own, which stock spaces around it may lack.
 * ODE's colliders of heightfields, of convexes with meshes and of GIMPACT's meshes read the box. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSweptBounds(dSpaceID space, dReal step);
ODE_PARALLEL_SAP_API dReal dParallelSAPSpaceGetSweptBounds(dSpaceID space);
/* 1 if a geom of this space might pass through another one, else 0: its motion |d| + a * r was more
 * than half of its shape's smallest side when its swept box was last made. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceIsFast(dSpaceID space, dGeomID geom);

/* dCollide, with SetSweptBounds, that sees what fast geoms meet: if they move in `step` seconds,
 * by their enabled bodies' velocities, by more than half of a moving one's smallest side, contacts
 * are those where they first touch on the way. For joints, depth is minus the way that is left, for
 * dContactMotionN with motionN = depth / step, but not beside dContactBounce. What does not answer
 * stops a body without turning it. Between two bodies that do, the impulse is near the right one:
 * the guide says how near. Up to 1,000 places are tried, a quarter of that side apart. No other
 * thread may use these geoms. */
ODE_PARALLEL_SAP_API int dParallelSAPCollideSwept(dGeomID o1, dGeomID o2, dReal step, int flags,
                                                  dContactGeom* contacts, int skip);

/* The last collide, not dSpaceCollide2. Times are wall-clock milliseconds, 0 if not taken. */
typedef struct dParallelSAPStats {
  unsigned long long frames;          /* such collides since the space was created */
  size_t geoms;                       /* geoms in the space */
  size_t moved;                       /* geoms whose AABB was brought up to date */
  size_t disabled;                    /* geoms left out: disabled, zero-sized, or empty */
  size_t invalid;                     /* geoms left out: a NaN bound */
  size_t unbounded;                   /* geoms with an infinite or inverted AABB */
  unsigned long long candidates;      /* pairs found in this frame, before the filter */
  unsigned long long pairs;           /* pairs reported to the callback, or collided for contacts */
  unsigned long long contacts;        /* contacts reported to the contact callback */
  int backend;                        /* dParallelSAPBackendCPU or dParallelSAPBackendCUDA */
  int method;                         /* that ran: a dParallelSAPMethod, never Auto */
  int threads;                        /* threads used by the widest stage */
  int devices;                        /* GPUs used */
  double update_ms;                   /* AABBs of the geoms that moved */
  double synchronise_ms;              /* taking planes out */
  double extract_ms;                  /* finding pairs; up to 120 geoms: all before the report */
  double filter_ms;                   /* AABBTest calls, pairs of planes */
  double narrow_ms;                   /* the contacts of all pairs */
  double report_ms;                   /* the callbacks, with all that they did */
  double total_ms;                    /* the whole call */
  size_t memory_bytes;                /* of the space's own structures, not of geoms */
  unsigned long long kept;            /* pairs kept from the last frame, when little changed */
  double events_ms;                   /* which pairs began and ended */
  unsigned long long apart;           /* pairs certainly apart, without dCollide */
  int find_threads;                   /* threads used by the widest stage that finds pairs */
  int narrow_threads;                 /* threads that found contacts */
  unsigned long long candidates_kept; /* pairs of boxes with a margin, kept from earlier frames */
} dParallelSAPStats;
/* Fills *stats; all zero before the first collide. In scenes of up to 120 geoms one frame in
 * sixteen is timed, from the first call on. Under SetSkipStatic, geoms without body may count as
 * disabled or not by when they last moved, unless they are announced (SetNotified). */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceGetStats(dSpaceID space, dParallelSAPStats* stats);

/* The macros below call these with the sizes of the program's structs. Fields of the statistics
 * that the library does not know become 0; unknown callbacks and larger rays and hits are an error.
 * Functions without size, for dlsym and older programs, take version 0.1's structs. A program of
 * another precision, or with another ODE than the library's, is an error when it makes a space. */
ODE_PARALLEL_SAP_API dSpaceID dParallelSAPSpaceCreateSized(size_t real_size, void (*ode)(void),
                                                           dSpaceID parent);
ODE_PARALLEL_SAP_API void dParallelSAPSpaceGetStatsSized(size_t size, dSpaceID space,
                                                         dParallelSAPStats* stats);
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollideContactsSized(
    size_t size, dSpaceID space, void* data, int flags,
    const dParallelSAPContactCallbacks* callbacks);
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRaysSized(size_t ray_size, size_t hit_size,
                                                       dSpaceID space, const dParallelSAPRay* rays,
                                                       size_t count, int flags,
                                                       dParallelSAPRayHit* nearest);
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRayHitsSized(size_t ray_size, size_t hit_size,
                                                          dSpaceID space,
                                                          const dParallelSAPRay* rays, size_t count,
                                                          int flags, void* data,
                                                          dParallelSAPRayCallback* callback);
#if defined(__cplusplus) || (defined(__STDC_VERSION__) && __STDC_VERSION__ >= 199901L)
#define dParallelSAPSpaceCreate(...) \
  dParallelSAPSpaceCreateSized(sizeof(dReal), dCloseODE, __VA_ARGS__)
#define dParallelSAPSpaceGetStats(...) \
  dParallelSAPSpaceGetStatsSized(sizeof(dParallelSAPStats), __VA_ARGS__)
#define dParallelSAPSpaceCollideContacts(...) \
  dParallelSAPSpaceCollideContactsSized(sizeof(dParallelSAPContactCallbacks), __VA_ARGS__)
#define dParallelSAPSpaceRays(...) \
  dParallelSAPSpaceRaysSized(sizeof(dParallelSAPRay), sizeof(dParallelSAPRayHit), __VA_ARGS__)
#define dParallelSAPSpaceRayHits(...) \
  dParallelSAPSpaceRayHitsSized(sizeof(dParallelSAPRay), sizeof(dParallelSAPRayHit), __VA_ARGS__)
#else /* C89: no variadic macros, nor compound literals, whose commas need them */
#define dParallelSAPSpaceCreate(a) dParallelSAPSpaceCreateSized(sizeof(dReal), dCloseODE, a)
#define dParallelSAPSpaceGetStats(a, b) \
  dParallelSAPSpaceGetStatsSized(sizeof(dParallelSAPStats), a, b)
#define dParallelSAPSpaceCollideContacts(a, b, c, d) \
  dParallelSAPSpaceCollideContactsSized(sizeof(dParallelSAPContactCallbacks), a, b, c, d)
#define dParallelSAPSpaceRays(a, b, c, d, e) \
  dParallelSAPSpaceRaysSized(sizeof(dParallelSAPRay), sizeof(dParallelSAPRayHit), a, b, c, d, e)
#define dParallelSAPSpaceRayHits(a, b, c, d, e, f)                                               \
  dParallelSAPSpaceRayHitsSized(sizeof(dParallelSAPRay), sizeof(dParallelSAPRayHit), a, b, c, d, \
                                e, f)
#endif

/* Environment variables, read when a space is created, set what the program does not set. dMessage
 * reports unknown names and values, and what is not available, once each. They are ignored.
 * - ODE_PARALLEL_SAP_BACKEND=auto|cpu|cuda, _METHOD=auto|sweep|brute-force|axis-lists, _THREADS=n,
 *   _DEVICES=n, _SKIP_STATIC=0|1, _SKIP_ASLEEP=0|1, _CULL_PLANES=0|1, _TOLERANCE=length: the
 *   settings above. So is _NOTIFIED=0|1|check, where check reports the first missing notification.
 * - ODE_PARALLEL_SAP_STATS=1: each space prints at its end, by dMessage, or at that of the process,
 *   on stderr: what its frames, queries and rays took; which settings would leave out pairs; which
 *   calls do queries in batches; geoms, in sub-spaces too, that move by more than half of their
 *   smallest side between frames, lie too far for dReal (a step is 1/512 of that side), or have NaN.
 * - ODE_PARALLEL_SAP_SIMD=portable|sse2|avx2|avx512|neon: instruction set of the process.
 * - ODE_PARALLEL_SAP_TRACE=path[:every]: spaces that collide write traces to path, path.2 and so
 *   on. %p in it becomes the process's number. The preload library has more (space/preload). */
#ifdef __cplusplus
}
#endif
#endif
