/* dParallelSAPSpace: an exact, deterministic, parallel broad phase for the Open Dynamics Engine.
 *
 *     dSpaceID space = dParallelSAPSpaceCreate (0);      // instead of dHashSpaceCreate (0)
 *
 * All functions of ODE for spaces work with this one. Its promises hold for all methods, back ends
 * and numbers of threads.
 *
 * Pairs: a collide reports the pairs of dSimpleSpace, each once. Two geoms are a pair if
 *
 * - their bounding boxes (AABBs) overlap as closed intervals in dReal,
 * - a category bit of one is a collide bit of the other,
 * - they are not both on one body,
 * - both AABBTest calls pass,
 * - both are enabled, and neither is zero-sized.
 *
 * Only settings that are off by default change this rule. A sub-space that holds no geom at any
 * depth is in no pair. A geom with a NaN bound is in no pair: dMessage reports it once, and the
 * statistics count it. Infinite, inverted, denormal and huge bounds follow the rule, in any
 * floating-point mode.
 *
 * Order: pairs ascend by (earlier geom, later geom), counted by when each was last added to the
 * space. The earlier geom is the callback's first argument. dSpaceCollide2 visits the geoms of
 * this space in the same order, but keeps ODE's order of arguments. As in ODE, the geom that it is
 * called with may be disabled or zero-sized.
 *
 * Contacts: those of dCollide, bit for bit, in the order of the pairs, with any build of ODE.
 *
 * Time: linear in geoms and pairs, except with BruteForce and AxisLists. No frame takes more than
 * twice as long as in a new space, plus allocations. A frame waits for no thread that has not
 * begun its work, unless CUDA is set.
 *
 * Failures: a missing thread, GPU or memory costs time, never pairs. dDebug ends the program only
 * if there is no memory for the results of a single pair, ray or probe.
 *
 * Callbacks:
 *
 * | callback                                       | thread                | may       |
 * | ---------------------------------------------- | --------------------- | --------- |
 * | near, contact, ray, overlap; blocks in order   | calling, space locked | edit      |
 * | dParallelSAPSpacesCallback                     | calling, space locked | add pairs |
 * | AABB, AABBTest of user classes                 | calling, space locked | compute   |
 * | flags, reduce; query filter                    | many at once          | read      |
 * | blocks with dParallelSAPPairsConcurrent        | many at once          | work      |
 *
 * - Edit: collide any space, throw, destroy geoms, and change their bits, bodies and enabled
 *   states. Also remove, add and move geoms, of locked spaces only if ODE is built without
 *   assertions.
 * - Add pairs: call dParallelSAPAddPair, collide any space, throw, but change no geom.
 * - Compute: neither change a geom of the space nor collide it. These calls come before the first
 *   report.
 * - Read: read geoms, bodies and joints, as dAreConnectedExcluding does, and throw. Do nothing
 *   else with ODE, and write no data that another thread may read.
 * - Work: read likewise, throw, and write data that belongs to the block's pairs alone. Also call
 *   what the table below lists, and collide other spaces that no other thread uses.
 *
 * A geom that left is in no further report of a running call, even if it came back. A geom that
 * came is in calls that begin later. Changed bits, bodies and enabled states count from later
 * calls on, too. Two exceptions: dSpaceCollide2 of two spaces, and geoms that come back to a stock
 * sub-space.
 *
 * A throw unlocks the space. A longjmp does not, as in ODE. Pairs stay right after it, and events
 * resume with the next call that is no deeper on the stack. pthread_cancel in a callback that many
 * threads run ends the process.
 *
 * Threads: different spaces may be used by different threads at once, one space by one thread at a
 * time. Debug builds assert this, others report it once. dSpaceCollide2 with a geom also uses the
 * space of that geom. These calls may run on many threads at once with one space:
 *
 * | call                                                       | while                   |
 * | ---------------------------------------------------------- | ----------------------- |
 * | dSpaceCollide2 (geom, space), Rays, RayHits, Overlaps      | nothing changes         |
 * | GetPairNumbers, FindPair                                   | no collide begins       |
 * | Notify with a geom                                         | nothing else uses it    |
 *
 * "Nothing changes" means that no geom of these spaces and their sub-spaces is moved, added,
 * removed or changed, and that no sub-space has swept bounds. If threads ask sub-spaces, too,
 * dSpaceClean must come after dGeomTriMeshSetData. Threads must not share probes, nor heightfield
 * data, to which ODE's colliders write.
 *
 * Errors: a wrong argument fails an assertion, as in ODE: dDebug names the function. Later
 * versions may add fields at the end of the structs of statistics, contact callbacks, rays, hits
 * and probes. Each call passes their size. All other structs stay as they are. */
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
/* Creates a space, inside `parent` if that is not 0. dSpaceDestroy destroys it with its geoms.
 * After dSpaceSetCleanup (space, 0), the geoms stay. */
ODE_PARALLEL_SAP_API dSpaceID dParallelSAPSpaceCreate(dSpaceID parent);

/* 1 if dParallelSAPSpaceCreate made the space, else 0. */
ODE_PARALLEL_SAP_API int dSpaceIsParallelSAP(dSpaceID space);

/* Declares that a class of dCreateGeomClass has no AABBTest, up to the end of the process. */
ODE_PARALLEL_SAP_API void dParallelSAPClassHasNoAABBTest(int geom_class);

/* Where pairs are found.
 *
 * - Auto sends each frame to the CPU or to GPUs, by the times of past frames. It loads the driver
 *   once GPUs could have saved 50 ms.
 * - CUDA loads the driver when it is set. A thread makes a GPU ready in up to 1 s, and frames wait
 *   for it. GPUs run AxisLists, and Sweep if floats suffice.
 *
 * dMessage reports a GPU that fails. One that was full or reset is tried again. A forked child
 * uses the CPU. */
enum { dParallelSAPBackendAuto, dParallelSAPBackendCPU, dParallelSAPBackendCUDA };
/* Default: Auto. Returns 1. If the build or the machine lacks the back end, returns 0 and changes
 * nothing. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetBackend(dSpaceID space, int backend);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetBackend(dSpaceID space);

/* How pairs are found. AxisLists is there for comparison. It is section 5.1 of Avril, Gouranton
 * and Arnaldi, "Collision Detection: Broad Phase Adaptation from Multi-Core to Multi-GPU
 * Architecture". If its lists need more than half of the free memory, Sweep runs, and dMessage
 * says so once. */
enum {
  dParallelSAPMethodAuto,       /* the fastest one for the scene */
  dParallelSAPMethodSweep,      /* subdivided sweep and prune: time linear in geoms and pairs */
  dParallelSAPMethodBruteForce, /* all (n*n-n)/2 pairs, in equal parts a thread */
  dParallelSAPMethodAxisLists   /* the pairs of each axis as lists, then their intersection */
};
/* Default: Auto. Returns 1. A number that is no method is an error; without assertions in ODE it
 * returns 0 and changes nothing. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetMethod(dSpaceID space, int method);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetMethod(dSpaceID space);

/* The most threads of a collide: 1 to 256, and larger numbers count as 256. Default: 0, OpenMP's
 * number (affinity, OMP_NUM_THREADS). The first large collide starts the threads, and all spaces
 * share them. Small scenes use one thread. So does a forked child whose parent had started
 * threads. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNumThreads(dSpaceID space, int n);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNumThreads(dSpaceID space);

/* The most GPUs that share a frame. Default: 0, chosen by the times of past frames. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNumDevices(dSpaceID space, int n);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNumDevices(dSpaceID space);

/* Nonzero: a plane and a geom whose AABB is wholly on its open side are no pair. No pair with a
 * contact is left out. It holds for dSpaceCollide2, too. Default: 0, as in ODE's spaces. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetCullPlanes(dSpaceID space, int cull);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetCullPlanes(dSpaceID space);

/* Called for each pair that touches. `count` is 1 or more. `contacts` last until it returns. It
 * may edit (see Callbacks above). Thread: the calling one, with the space locked. Order: that of
 * the pairs. */
typedef void dParallelSAPContactCallback(void* data, dGeomID o1, dGeomID o2,
                                         const dContactGeom* contacts, int count);

/* Returns the flags of dCollide for a pair. The lower 16 bits are the most contacts, and 0 leaves
 * the pair out. CONTACTS_UNIMPORTANT and dParallelSAPOnCallingThread may be added. Other bits are
 * an error.
 * Threads: IT IS CALLED FROM MANY THREADS AT ONCE, in no order. It may read geoms, bodies and
 * joints, and no more (see Callbacks above).
 * Errors: if it throws, one exception leaves the call, without any report. After bad_alloc, the
 * call instead collides pairs one by one. */
typedef int dParallelSAPFlagsCallback(void* data, dGeomID o1, dGeomID o2);

/* Called after dCollide for each pair that touches. It may change and reorder the contacts. It
 * returns how many remain, from the first on. CALLED FROM MANY THREADS, like the flags
 * callback. */
typedef int dParallelSAPReduceCallback(void* data, dGeomID o1, dGeomID o2, dContactGeom* contacts,
                                       int count);

/* For reduce callbacks: `return dParallelSAPKeepSpread (contacts, count, 4);`. They move the best
 * contacts to the front and return their number, up to `most`.
 *
 * - KeepDeepest keeps the deepest first.
 * - KeepSpread keeps the deepest, and then the farthest from it. Then it always keeps the contact
 *   that adds most area to the hull along the first one's normal, or if none does, the deepest.
 *
 * Contacts beside an AABB of their geoms come last. Contacts without a normal or with a NaN are
 * dropped. Threads: any. Order: the rest, and equals, keep theirs. */
ODE_PARALLEL_SAP_API int dParallelSAPKeepDeepest(dContactGeom* contacts, int count, int most);
ODE_PARALLEL_SAP_API int dParallelSAPKeepSpread(dContactGeom* contacts, int count, int most);

/* Called for each pair with a space in it. It adds pairs instead, mostly by dSpaceCollide2 (o1,
 * o2, pairs, dParallelSAPAddPair), and changes no geom. Thread: the calling one. Order: that of
 * the pairs. */
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

/* The narrow phase on all threads of the space. It finds the pairs of dSpaceCollide, calls
 * dCollide for them, and reports the contacts. `flags` are those of dCollide for all pairs, and
 * must ask for 1 contact or more. A flags callback replaces them. `data` goes to all callbacks.
 * All pairs are collided before the first report.
 *
 * Threads: the calling thread needs ODE's data, as for dCollide (dAllocateODEDataForThread). Other
 * threads allocate theirs, and free them at the end if dSpaceSetManualCleanup is set. dCollide
 * runs
 *
 * - on any thread for spheres, boxes, capsules, cylinders, convexes, planes, rays and OPCODE's
 *   meshes;
 * - on any thread, in an image, for heightfields, and for meshes if dCheckConfiguration
 *   ("ODE_EXT_mt_collisions") is 0;
 * - on the calling thread alone for geom transforms, user classes and GIMPACT's meshes;
 * - likewise for meshes with callbacks or temporal coherence, and heightfields with callbacks;
 * - likewise for meshes with heightfields if the above is 1, and with dParallelSAPOnCallingThread.
 *
 * An image is ODE's library, loaded again (2 MB). If that fails, dMessage says why, and the
 * calling thread collides these pairs. Calling threads take turns at meshes. A collider of
 * dSetColliderOverride runs on any thread, or on the calling thread if its pair needs an image.
 *
 * Errors: without memory for all contacts, pairs are collided one by one. Flags and reduce
 * callbacks may then be called again. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollideContacts(
    dSpaceID space, void* data, int flags, const dParallelSAPContactCallbacks* callbacks);

/* A pair of dParallelSAPSpaceCollidePairs. */
typedef struct dParallelSAPPair {
  dGeomID o1, o2; /* as the near callback gets them */
} dParallelSAPPair;
/* Gets a block of the frame's pairs, in their order. `first` is the place of pairs[0] among all
 * pairs of the frame. `count` is 1 or more. It is the same for all blocks but the last, if no geom
 * leaves. `pairs` last until it returns. */
typedef void dParallelSAPPairsCallback(void* data, const dParallelSAPPair* pairs, size_t count,
                                       size_t first);
enum { dParallelSAPPairsConcurrent = 1 }; /* flag: blocks go to many threads at once, unordered */

/* Finds the pairs of dSpaceCollide and hands them out in blocks of some hundred. With `callback`
 * 0, pairs are only found and counted, for programs that use begun and ended pairs.
 *
 * Threads: with `flags` 0, blocks come in order, on the calling thread, under the rules of near
 * callbacks. With dParallelSAPPairsConcurrent THE CALLBACK IS CALLED FROM MANY THREADS AT ONCE,
 * under the rules of Work (see Callbacks above). For dCollide it must allocate its thread's data,
 * and know which geoms other threads collide. It runs in the caller's floating-point mode: on x86
 * that of SSE, while x87's is the thread's own.
 *
 * Errors: if a concurrent callback throws, no further block begins, and one exception leaves this
 * call. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollidePairs(dSpaceID space, void* data, int flags,
                                                        dParallelSAPPairsCallback* callback);

/* A ray of dParallelSAPSpaceRays. */
typedef struct dParallelSAPRay {
  dVector3 origin;                           /* where it begins */
  dVector3 direction;                        /* of any length but 0: dGeomRaySet makes it 1 */
  dReal length;                              /* 0 or more */
  unsigned long category_bits, collide_bits; /* as a geom's. If both are 0, the ray has all bits */
  dBodyID ignore;                            /* the ray goes through its geoms; 0: none */
} dParallelSAPRay;

/* Where a ray hits a geom. */
typedef struct dParallelSAPRayHit {
  dGeomID geom;         /* 0: the ray hits nothing */
  dReal distance;       /* from the origin: the depth of the contact of dCollide (ray, geom, ...) */
  dVector3 pos, normal; /* of this contact */
  int side;             /* of the geom in this contact (side2): a mesh's triangle, or -1 */
} dParallelSAPRayHit;
/* Flags of rays: as dGeomRaySetFirstContact, -BackfaceCull and -ClosestHit. With FirstContact, the
 * "nearest" hit of a mesh is any of its hits, maybe on its far side, even with ClosestHit. The
 * lower 16 bits are the most hits of a ray with one geom, the nearest ones. 0 means one. */
enum {
  dParallelSAPRayFirstContact = 0x10000,
  dParallelSAPRayBackfaceCull = 0x20000,
  dParallelSAPRayClosestHit = 0x40000
};
/* Writes the nearest hit of rays[i] to nearest[i]. Returns the number of rays with a hit. A hit
 * is, bit for bit, the nearest of all contacts of dCollide with the geoms that dSpaceCollide2
 * reports for the ray, in sub-spaces too. Of the settings for pairs, swept bounds alone count.
 *
 * A ray hits nothing if its origin or direction is not finite, its direction 0, or its length
 * negative or NaN. Meshes without callbacks are asked for the closest hit alone. On a heightfield,
 * a contact that is not on the ray is no hit: ODE makes one if all ground near it is higher.
 *
 * Ownership: the space keeps trees over its geoms while rays come, if memory allows.
 * Threads: as in dParallelSAPSpaceCollideContacts. Overridden colliders of rays with spheres,
 * boxes, capsules and cylinders may run on any thread. Their hits may be left out if the ray misses
 * the geom's AABB.
 * Order: of hits at one distance, the one with the geom added earlier counts. Geoms of a sub-space
 * have its place. Among each other they have the order of dSpaceGetGeom, but in a
 * dSweepAndPruneSpace or dQuadTreeSpace the one added last comes first. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRays(dSpaceID space, const dParallelSAPRay* rays,
                                                  size_t count, int flags,
                                                  dParallelSAPRayHit* nearest);

/* Gets all hits of rays[ray], the nearest first. `hits` last until it returns. It may do what near
 * callbacks may. */
typedef void dParallelSAPRayCallback(void* data, size_t ray, const dParallelSAPRayHit* hits,
                                     size_t count);
/* Finds all hits, at most `flags` & 0xffff with a geom (0: one). Then it calls the callback for
 * each ray that has any. Returns the number of hits.
 * Thread of the callback: the calling one, with the space locked. Order: that of the rays. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRayHits(dSpaceID space, const dParallelSAPRay* rays,
                                                     size_t count, int flags, void* data,
                                                     dParallelSAPRayCallback* callback);

/* A probe of dParallelSAPSpaceOverlaps. */
typedef struct dParallelSAPProbe {
  dGeomID geom;   /* in any space or none; itself no space, and in no other probe */
  dBodyID ignore; /* the probe goes through its geoms; 0: none */
  size_t touched; /* is written: the number of geoms that it touches */
} dParallelSAPProbe;
enum { dParallelSAPOverlapAny = 0x10000 }; /* flag: `touched` is 1 or 0, and no callback */

/* Gets the contacts of a probe and one geom, as dCollide (probe, geom) finds them. They last until
 * it returns. It may do what near callbacks may, but not change probes. */
typedef void dParallelSAPOverlapCallback(void* data, size_t probe, dGeomID geom,
                                         const dContactGeom* contacts, int count);

/* Finds the geoms that each probe touches. Returns the sum of all `touched`. A probe touches the
 * geoms that dSpaceCollide2 (probe, space) reports, in sub-spaces too, if dCollide (probe, geom,
 * flags) finds contacts, bit for bit. `flags` 0 asks for one contact a geom. `size` is sizeof
 * (dParallelSAPProbe). `callback` may be 0. It is called when all have been found.
 * Threads: as in dParallelSAPSpaceCollideContacts. The callback runs on the calling thread, with
 * the space locked.
 * Order: that of the probes, and then of the geoms, in sub-spaces as of rays. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceOverlaps(dSpaceID space, dParallelSAPProbe* probes,
                                                      size_t count, size_t size, int flags,
                                                      void* data,
                                                      dParallelSAPOverlapCallback* callback);

/* Whether a query, rays[query] or probes[query], may meet a geom. With 0 it goes through the geom.
 * IT IS CALLED FROM MANY THREADS AT ONCE, in no order, under the rules of flags callbacks. */
typedef int dParallelSAPQueryFilter(void* data, size_t query, dGeomID geom);
/* Sets the filter of Rays, RayHits and Overlaps. Default: 0, none. It is called before dCollide,
 * for geoms whose AABB overlaps the query's, those of sub-spaces too, but for no space. The same
 * geom may come again. Filters of sub-spaces have no effect.
 * Threads: not while other threads query the space.
 * Errors: if the filter throws, one exception leaves the query's call, without any report. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetQueryFilter(dSpaceID space,
                                                          dParallelSAPQueryFilter* filter,
                                                          void* data);

/* Events: pairs and touches that began or ended since the collide before.
 *
 * - Pairs: of any collide but dSpaceCollide2. The first collide begins all its pairs.
 * - Touches: geoms whose contacts went to the contact callback of
 *   dParallelSAPSpaceCollideContacts. A touch ends if a later such collide reports no contacts of
 *   it. ODE may find none, the flags may be 0, the reduce callback may leave none, or a geom may
 *   be disabled or gone. Of two sub-spaces ODE reports disabled geoms of one, whose touches last.
 *   Other collides change no touch, and asking for touches after one says so once.
 *
 * A pair that SetSkipStatic or SetSkipAsleep leaves out does not end. Nor does its touch. Both end
 * when a geom leaves or is disabled, when bits match no longer, or when AABBs are apart, by more
 * than a tolerance. A geom that is removed and added again ends its pairs and touches, and begins
 * them anew.
 *
 * Geoms in sub-spaces have touches, too, but pairs are those of the space itself. Such a geom
 * keeps its touches if its sub-space leaves and comes back between two collides. So does a geom
 * that leaves a stock sub-space and comes back.
 *
 * Pairs' events are known before the first report, touches' events before the first contact
 * callback. Both stay until the next collide, and still name geoms that callbacks destroy
 * meanwhile. A collide has no events within a callback of this space or without memory. It has no
 * touches' events if its flags or reduce callback throws. A later collide then reports the changes.
 */
enum { dParallelSAPEventPairs = 1, dParallelSAPEventTouches = 2 };
/* `events` is a sum of these bits. Default: 0. Touches that are switched on all begin in the next
 * collide. So do pairs, unless touches were on already: pairs that last then do not begin. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetEvents(dSpaceID space, int events);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetEvents(dSpaceID space);

/* A pair or touch that began or ended. A pair that begins gets the lowest free number, in the
 * order of the pairs. It keeps the number up to its ended event, and the next collide may give it
 * to another pair. So numbers can index an array. A touch begins with the number of its pair and
 * keeps it. No other pair gets the number before both have ended. A touch in sub-spaces has a
 * number of its own. */
typedef struct dParallelSAPPairEvent {
  dGeomID o1, o2;  /* as reported; of what ended, 0 if it has left its space: it may not exist */
  size_t place;    /* among the collide's pairs; of an ended pair, in the last collide that reported
                      it; of an ended touch, in the last with contacts that did; of a touch in
                      sub-spaces, the place of the pair of these */
  unsigned number; /* as long as it lasts */
} dParallelSAPPairEvent;
/* The pairs that began. Sets *pairs to the first, or to 0 if there is none, and returns their
 * number. Ownership: they belong to the space and stay until its next collide. Errors: if these
 * events are off, dMessage says so once. Order: by place. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetBegunPairs(dSpaceID space,
                                                           const dParallelSAPPairEvent** pairs);
/* The pairs that ended, likewise. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetEndedPairs(dSpaceID space,
                                                           const dParallelSAPPairEvent** pairs);
/* The touches that began or ended, likewise. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetBegunTouches(dSpaceID space,
                                                             const dParallelSAPPairEvent** touches);
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetEndedTouches(dSpaceID space,
                                                             const dParallelSAPPairEvent** touches);
/* The numbers of all pairs of the last collide, likewise. Threads: many may read them. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetPairNumbers(dSpaceID space,
                                                            const unsigned** numbers);

/* Finds a pair of the last collide, whichever geom is named first. Returns 1 and sets *number, or
 * returns 0. Needs dParallelSAPEventPairs. Threads: many at once. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceFindPair(dSpaceID space, dGeomID o1, dGeomID o2,
                                                   unsigned* number);

/* Nonzero: pairs at rest are left out, except in dSpaceCollide2. A static pair has no body. A pair
 * asleep has one body or two, all disabled. A body that is enabled in any way has its pairs in the
 * next collide. Pairs of sub-spaces are never at rest. Default: 0, as in ODE. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSkipStatic(dSpaceID space, int skip);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetSkipStatic(dSpaceID space);
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSkipAsleep(dSpaceID space, int skip);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetSkipAsleep(dSpaceID space);

/* Nonzero: the program promises to announce changes that ODE does not announce. It calls
 * dParallelSAPSpaceNotify before the next collide. Frames then look for no such changes. These are
 *
 * - a geom gets other category or collide bits;
 * - a geom is enabled or disabled;
 * - a geom loses its body (dGeomSetBody (geom, 0), dBodyDestroy, dWorldDestroy);
 * - under SetSkipAsleep, a call wakes its body (dBodyEnable, dBodySetAutoDisableFlag, -Defaults).
 *   A step that wakes it needs no call.
 *
 * A missing call may cost or add pairs. ODE_PARALLEL_SAP_NOTIFIED=check finds it. The setting has
 * no effect up to 120 geoms. Default: 0. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNotified(dSpaceID space, int notified);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNotified(dSpaceID space);
/* Announces a change of a geom of the space, or with `geom` 0, of any of its geoms. It may be
 * called in callbacks. Threads: for geoms, many at once while nothing else uses the space. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceNotify(dSpaceID space, dGeomID geom);

/* A length, finite, 0 or more. AABBs that are up to this far apart on each axis may be reported as
 * pairs, except in dSpaceCollide2. No overlap is missed. All runs with Sweep have the same extra
 * pairs, and with Auto above 120 geoms, above 200 if the tolerance changes. BruteForce, AxisLists
 * and smaller scenes have others.
 * Default: 0. A tolerance saves time if geoms move by less than 1/5 of it a frame, and lie within
 * 2^18 tolerances of the origin. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetTolerance(dSpaceID space, dReal distance);
ODE_PARALLEL_SAP_API dReal dParallelSAPSpaceGetTolerance(dSpaceID space);

/* Writes a trace to the file `path`: the space's geoms and number of pairs, at each `every`-th
 * collide. It can be replayed without the program (space/trace in the sources). dSpaceCollide2,
 * collides in callbacks and forked children write none. Returns 1, or 0 if the file cannot be
 * made. Each call ends the trace before it, and `path` 0 does only that. GetTrace returns `every`,
 * or 0.
 * Threads: not while the space is locked. Errors: if writing fails, dMessage says so once. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetTrace(dSpaceID space, const char* path, int every);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetTrace(dSpaceID space);

/* Seconds, finite, 0 or more. Each AABB covers its geom's motion in a coming step of that length,
 * so that pairs of fast bodies come in time. Default: 0. Pairs, queries and rays use these boxes.
 *
 * A swept box is, in dReal, with an enabled body's velocities when the collide begins,
 *     [lower + min (d, 0) - a * r, upper + max (d, 0) + a * r], d = linear velocity * step,
 *     a = the lesser of |angular velocity| * step and 2 (a NaN counts as 0),
 *     r = distance from the body's position to the AABB's farthest corner, or to a sphere's centre.
 * Forces are not covered. Each sub-space has a step of its own, and stock spaces around it may not
 * cover the motion. ODE's colliders of heightfields, of convexes with meshes and of GIMPACT's
 * meshes read the swept box. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSweptBounds(dSpaceID space, dReal step);
ODE_PARALLEL_SAP_API dReal dParallelSAPSpaceGetSweptBounds(dSpaceID space);
/* 1 if a geom of this space might pass through another one, else 0. It might if its motion
 * |d| + a * r was more than half of its shape's smallest side when its swept box was last made. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceIsFast(dSpaceID space, dGeomID geom);

/* dCollide for fast geoms, with SetSweptBounds. Returns the number of contacts. Geoms whose motion
 * is more than half of a moving one's smallest side get those where they first strike each other,
 * and then on along the wall. The way is that of enabled bodies' velocities in `step` seconds, as
 * if nothing else were there. Grazes no deeper than the lesser of 4 * gravity * step * step and
 * 1/32 of that side are no strikes. Slow contacts at the start come, too. Without a strike all
 * contacts are dCollide's.
 *
 * Units: the depth of a contact that is still to come is minus the way that is left. Joints then
 * need dContactMotionN with motionN = depth / step, but not beside dContactBounce. A geom without
 * a body or with a kinematic one turns a fast body by friction only. Between two other bodies the
 * impulse is near the right one: the guide says how near. Where these would slide or turn while
 * they approach, the depth is 0. Up to 1,000 places are tried, a quarter of that side apart.
 * Threads: no other thread may use these geoms. */
ODE_PARALLEL_SAP_API int dParallelSAPCollideSwept(dGeomID o1, dGeomID o2, dReal step, int flags,
                                                  dContactGeom* contacts, int skip);

/* The statistics of the last collide, not dSpaceCollide2. Times are wall-clock milliseconds, 0 if
 * not taken. */
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
  double update_ms;                   /* AABBs of the geoms that moved, and a tree if few did */
  double synchronise_ms;              /* 0: extraction takes planes now */
  double extract_ms;                  /* finding pairs; up to 120 geoms: all before the report */
  double filter_ms;                   /* AABBTest calls, changed rest and bits */
  double narrow_ms;                   /* the contacts of all pairs */
  double report_ms;                   /* the callbacks, with all that they did */
  double total_ms;                    /* the whole call */
  size_t memory_bytes;                /* of the space's own structures, not of geoms */
  unsigned long long kept;            /* pairs kept from the last frame, when little changed */
  double events_ms;                   /* which pairs began and ended */
  unsigned long long apart;           /* 0: dCollide is called for all pairs now */
  int find_threads;                   /* threads used by the widest stage that finds pairs */
  int narrow_threads;                 /* threads that found contacts */
  unsigned long long candidates_kept; /* pairs of boxes with a margin, kept from earlier frames */
} dParallelSAPStats;
/* Fills *stats, with zeros before the first collide. In scenes of up to 120 geoms one frame in
 * sixteen is timed, from the first call on. Under SetSkipStatic, `disabled` counts geoms without
 * body or not, by when they last moved, unless they are announced (SetNotified). */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceGetStats(dSpaceID space, dParallelSAPStats* stats);

/* The macros below call these functions with the sizes of the program's structs. Fields of the
 * statistics that the library does not know become 0. Unknown callbacks and larger rays and hits
 * are an error. Functions without size, for dlsym and older programs, take version 0.1's structs.
 * A space cannot be made by a program of another precision, or with another ODE than the
 * library's. */
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

/* Environment variables, read when a space is created. They set what the program does not set.
 * dMessage reports unknown names and values, and what is not available, once each. These are
 * ignored.
 *
 * - ODE_PARALLEL_SAP_BACKEND=auto|cpu|cuda, _METHOD=auto|sweep|brute-force|axis-lists, _THREADS=n,
 *   _DEVICES=n, _SKIP_STATIC=0|1, _SKIP_ASLEEP=0|1, _CULL_PLANES=0|1, _TOLERANCE=length: the
 *   settings above. So is _NOTIFIED=0|1|check, where check reports the first missing notification.
 * - ODE_PARALLEL_SAP_STATS=1: each space prints a summary by dMessage when it ends, or on stderr
 *   when the process does. It has times, settings that would leave out pairs, and calls that do
 *   queries in batches. Of collides, not dSpaceCollide2, it counts geoms, in sub-spaces too, that
 *   have NaN, lie where a step of dReal is more than 1/512 of their smallest side, or move by more
 *   than half of it between frames: along their body's velocity, or else twice in a row.
 * - ODE_PARALLEL_SAP_SIMD=portable|sse2|avx2|avx512|neon: instruction set of the process.
 * - ODE_PARALLEL_SAP_TRACE=path[:every]: spaces that collide write traces to path, path.2 and so
 *   on. %p in it becomes the process's number. The preload library has more (space/preload). */
#ifdef __cplusplus
}
#endif
#endif
