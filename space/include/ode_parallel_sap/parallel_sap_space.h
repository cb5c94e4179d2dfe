/* dParallelSAPSpace: an exact, deterministic, parallel broad phase for the Open Dynamics Engine.
 *
 *     dSpaceID space = dParallelSAPSpaceCreate (0);      // instead of dHashSpaceCreate (0)
 *
 * Everything else of a program stays as it is: dSpaceAdd, dSpaceRemove, dSpaceQuery, dSpaceGetGeom,
 * dSpaceSetCleanup, dSpaceSetSublevel, dSpaceClean, dSpaceCollide, dSpaceCollide2, dSpaceDestroy
 * and the geom constructors take this space like any other.
 *
 * What dSpaceCollide promises:
 *
 * - The pairs are those of dSimpleSpace, each once: bounding boxes that overlap as closed intervals
 *   in dReal, at least one category/collide match, not both geoms on one body, both AABBTest calls
 *   passed, both geoms enabled and neither zero-sized. This holds for every method, back end and
 *   number of threads.
 * - Their order is fixed: ascending by (earlier geom, later geom), where geoms count in the order
 *   in which they were last added to the space. The earlier geom is the callback's first argument.
 *   dSpaceCollide2 also visits this space's geoms in that order and keeps ODE's order of arguments.
 * - Bits, bodies and enabled states are read when the collide begins. The callback may enable and
 *   disable geoms of the space and their bodies: the next collide sees it.
 *   (Where there is no memory for the list of pairs, they are tested and reported one by one, and
 *   such changes take effect at once.)
 *   Nothing else of these geoms may change while the space is locked: in ODE it is an assertion to
 *   move or resize them, to change their bits or their body, to add or remove them. Geoms of spaces
 *   that are not locked may be changed in every way; their spaces see it in their next collide.
 * - AABB and AABBTest functions of user classes run on the calling thread, with the space locked,
 *   before the first pair is reported. They must not move or change a geom of the space, nor
 *   collide it. ODE does not say which classes have an AABBTest, so it is called for each pair (11
 *   ns) unless dParallelSAPClassHasNoAABBTest declares that there is none.
 * - The callback runs on the calling thread with the space locked. It may throw: the space is left
 *   unlocked and usable. It may collide any space, this one too. It may be left by longjmp: the
 *   space stays locked, as ODE's spaces do, and later calls are right. Until a call at the same or
 *   a shallower depth of that thread's stack, calls count as within that callback, for events too.
 * - A geom with a NaN bound is left out of the pairs, and dSpaceCollide2 finds nothing for it;
 *   dMessage reports it once, the statistics count it in every frame. (Infinite sizes of ODE's own
 *   classes often make one.) A ray of infinite length has no NaN bound: across an axis its box in
 *   this space ends where the ray begins. dGeomGetAABB gives that box after a collide. All other
 *   bounds, infinite, inverted and denormal ones too, follow the formula above, whatever
 *   floating-point mode the program runs in: rounding, flushed denormals, traps. The bounds
 *   themselves are computed by ODE in the program's mode.
 * - A sub-space that holds no geom, or only such sub-spaces, is never reported.
 *
 * The pairs differ from dSimpleSpace's in two cases:
 *
 * - dSimpleSpace may pair a geom with a NaN bound with any other, since each comparison fails.
 * - dSimpleSpace pairs an empty sub-space with what overlaps the origin.
 *
 * A stock sub-space makes its own box. ODE leaves the NaN bounds of its infinite rays out of it, so
 * dSpaceCollide may miss that sub-space, as dSimpleSpace does.
 *
 * Which call when: dSpaceCollide is always right. dParallelSAPSpaceCollideContacts is for callbacks
 * that would call dCollide and make joints: it calls dCollide on all threads.
 * dParallelSAPSpaceCollidePairs is for so many pairs that calling counts, and for callbacks of any
 * kind that may run on many threads. dParallelSAPSpaceRays is for many rays at once.
 * dParallelSAPSpaceSetEvents, with any of them, tells which
 * pairs began and ended, and numbers each for data that are kept of it.
 *
 * Threads: different spaces may be used from different threads at the same time; one space is used
 * by one thread at a time, which debug builds of the library assert. dSpaceCollide2 about a geom
 * uses the space that the geom is in, too, and may bring the geoms behind it up to date. ODE's own
 * rules for sharing worlds and geoms stay in force, and such spaces may not share the data of
 * heightfields (dHeightfieldDataID), to which ODE's collider writes. Threads of OpenMP's runtime
 * wait in the process for the next collide, so the library, and with it ODE and that runtime, stays
 * loaded when the plug-in that needed it is closed (dlclose); linked statically it asks the same of
 * the plug-in.
 *
 * Errors: a wrong argument (no space, a space of another kind, a negative count) is an assertion as
 * in ODE itself: dDebug names the function that was called. What the machine or the build cannot
 * provide is answered with 0 and leaves the setting as it was.
 */
#ifndef ODE_PARALLEL_SAP_PARALLEL_SAP_SPACE_H
#define ODE_PARALLEL_SAP_PARALLEL_SAP_SPACE_H

#include <stddef.h>

#include "ode/ode.h" /* where a fork has it elsewhere, a header of that name is installed beside this one */

#if defined(_WIN32) && defined(ODE_PARALLEL_SAP_SHARED)
#if defined(ODE_PARALLEL_SAP_BUILD)
#define ODE_PARALLEL_SAP_API __declspec(dllexport)
#else
#define ODE_PARALLEL_SAP_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define ODE_PARALLEL_SAP_API __attribute__((visibility("default")))
#else
#define ODE_PARALLEL_SAP_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Creates the space, inside `parent` if that is not 0. Like any ODE space it is destroyed by
 * dSpaceDestroy, which also destroys its geoms unless dSpaceSetCleanup (space, 0) was called. */
ODE_PARALLEL_SAP_API dSpaceID dParallelSAPSpaceCreate(dSpaceID parent);

/* 1 if the space was made by dParallelSAPSpaceCreate, else 0. (dGeomGetClass answers
 * dSweepAndPruneSpaceClass: ODE has no class numbers for spaces from outside.) */
ODE_PARALLEL_SAP_API int dSpaceIsParallelSAP(dSpaceID space);

/* Declares that a class of dCreateGeomClass has no AABBTest, so that spaces call none for its
 * geoms. Holds for all spaces, from their next collide to the end of the process: do not declare it
 * where a later class, made after dCloseODE, gets the same number and has one. Any thread. */
ODE_PARALLEL_SAP_API void dParallelSAPClassHasNoAABBTest(int geom_class);

/* Where overlapping pairs are found. The CUDA back end runs the method AxisLists, and Sweep in
 * scenes for which float boxes are fine enough; whatever else is asked for runs on the CPU, and the
 * statistics say so.
 *
 * Auto sends each frame to the CPU or to one or more GPUs, by what the last frames took. It loads
 * the driver once GPUs could have saved a space some 50 ms; another thread then makes them ready,
 * which takes up to a second, while frames go on on the CPU. Scenes that the CPU does as fast never
 * touch the driver. Pairs and their order do not depend on the choice.
 *
 * A GPU that fails is reported through dMessage and not used again by that space: the frame is
 * finished by the GPUs that are left, or on the CPU, and so are all frames after it. One that
 * cannot be made ready in the first place (other programs have left it no memory for a context,
 * say) is named once through dMessage and left out for the rest of the program, by all spaces; the
 * others serve.
 *
 * For programs that use CUDA themselves: each thread's current device and context are after a
 * collide what they were before, and a GPU that no space uses gets no context. */
enum {
  dParallelSAPBackendAuto, /* the faster one for the scene */
  dParallelSAPBackendCPU,
  dParallelSAPBackendCUDA
};

/* Returns 1, or 0 and leaves the setting unchanged where the back end is not to be had: not in this
 * build, or no usable device in this machine. Default: Auto. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetBackend(dSpaceID space, int backend);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetBackend(dSpaceID space);

/* How overlapping pairs are found. All methods find the same pairs in the same order.
 *
 * AxisLists is there for comparison: it follows section 5.1 of Avril, Gouranton and Arnaldi,
 * "Collision Detection: Broad Phase Adaptation from Multi-Core to Multi-GPU Architecture". It takes
 * time and memory for all pairs that overlap on one axis, of which there are some n^(5/3) in a cube
 * of n boxes. A scene whose lists would take more than half of the free memory (of the machine, or
 * of one of the GPUs) is reported once through dMessage and found by the method Sweep; the
 * statistics tell which one ran. */
enum {
  dParallelSAPMethodAuto,       /* the fastest one for the scene */
  dParallelSAPMethodSweep,      /* subdivided sweep and prune: time linear in geoms and pairs */
  dParallelSAPMethodBruteForce, /* all (n*n-n)/2 pairs, in equal parts a thread */
  dParallelSAPMethodAxisLists   /* the pairs of each axis as lists, then what they share */
};

/* Returns 1, or 0 and leaves the setting unchanged where the method is not to be had. Default:
 * Auto. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetMethod(dSpaceID space, int method);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetMethod(dSpaceID space);

/* The most threads a collide may use, 1 to 256 (more is taken as 256). 0, the default, stands for
 * what OpenMP would use (processor affinity, OMP_NUM_THREADS), or one thread for as long as a team
 * is slower, which happens where other programs hold the cores. Whatever is set, the pairs of small
 * scenes are found by one thread, and everything in the child of a process (fork) where the library
 * had started threads, as they are not the child's.
 *
 * OpenMP ends a program where it cannot start a thread: at a limit of processes or of address space.
 * So each calling thread first starts as many threads that do nothing, once for each larger team.
 * Where fewer can be had, these do the work, and dMessage says so once. A limit that is reached
 * later, by the program's other threads for instance, cannot be foreseen. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNumThreads(dSpaceID space, int n);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNumThreads(dSpaceID space);

/* The number of GPUs that share each frame of the CUDA back end, at most as many as there are that
 * have not been left out or failed this space. 0, the default, leaves it to the space, which takes
 * 1, 2, 4 or more by what frames took, for the method AxisLists always 1. With the back end Auto
 * frames go to this number of GPUs or to the CPU. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNumDevices(dSpaceID space, int n);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNumDevices(dSpaceID space);

/* Nonzero: a geom whose AABB is wholly on the open side of a plane (dCreatePlane), by more than
 * what rounding could make of it, is no pair with that plane. ODE's spaces report a plane that is
 * not parallel to two axes with every geom, so the default is 0. No pair is left out for which
 * dCollide could find a contact: the corner of the AABB that is nearest to the plane is further
 * from it than 32 epsilon of the greatest finite coordinates that take part. Pairs of two planes,
 * and of a plane with a geom whose AABB is infinite on the plane's side, stay; where it is infinite
 * on other sides only, the pair is left out like any other. Holds for all collides of this
 * space, dSpaceCollide2 too. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetCullPlanes(dSpaceID space, int cull);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetCullPlanes(dSpaceID space);

/* The narrow phase on the threads of the space: dCollide for all pairs of dSpaceCollide.
 *
 *     static void makeJoints(void* world, dGeomID o1, dGeomID o2, const dContactGeom* contacts,
 *                            int count) {...}
 *
 *     dParallelSAPContactCallbacks callbacks = {makeJoints};
 *     dParallelSAPSpaceCollideContacts(space, world, 8, &callbacks);
 *
 * does what dSpaceCollide does with a near callback that calls dCollide (o1, o2, 8, contacts,
 * sizeof (dContactGeom)) and makes joints of what it finds. It gives the same contacts, bit for
 * bit, in the same order, whatever the number of threads, as long as no callback moves or changes a
 * geom: all pairs are found before the first is collided, and all are collided before the first
 * contact is reported. */

/* Called on the calling thread for each pair that touches, in the order of the pairs, with the
 * space locked. `contacts` are dCollide's, `count` >= 1 of them, and last until the callback
 * returns. It may throw and may collide any space, like a near callback. */
typedef void dParallelSAPContactCallback(void* data, dGeomID o1, dGeomID o2,
                                         const dContactGeom* contacts, int count);

/* Returns the flags with which dCollide is to be called for a pair: the most contacts in the lower
 * 16 bits (none: the pair is passed over), CONTACTS_UNIMPORTANT, dParallelSAPOnCallingThread. Any
 * other bit is an error, so -1 is one.
 *
 * IT IS CALLED FROM MANY THREADS AT ONCE, in no particular order, while other threads read the
 * geoms. It may read geoms and bodies (dGeomGetData, dGeomGetClass, dGeomGetBody, dBodyIsEnabled,
 * ...) and do nothing else with ODE, and must not write what another thread may read. If it throws,
 * the exception (of several, one) leaves dParallelSAPSpaceCollideContacts on the calling thread,
 * without a contact reported. */
typedef int dParallelSAPFlagsCallback(void* data, dGeomID o1, dGeomID o2);

/* Called after dCollide for each pair that touches: may change and reorder the `count` contacts, to
 * keep the deepest ones, say, and returns how many of them are left, from the first on: 0 to
 * `count`. IT IS CALLED FROM MANY THREADS AT ONCE, and what is said of the flags callback holds for
 * it too. */
typedef int dParallelSAPReduceCallback(void* data, dGeomID o1, dGeomID o2, dContactGeom* contacts,
                                       int count);

/* For reduce callbacks, and anything else that has too many contacts of a pair: put those that are
 * to be kept first and return how many these are, `most` of them or all `count` if these are fewer.
 *
 *     static int keepFour(void*, dGeomID, dGeomID, dContactGeom* contacts, int count) {
 *       return dParallelSAPKeepSpread(contacts, count, 4);
 *     }
 *
 * KeepDeepest keeps the deepest ones, the deepest first. KeepSpread keeps those that hold a body
 * best: the deepest one, the one farthest from it, and then always the one that adds most to the
 * area of the convex hull of those chosen, seen along the normal of the first; where none adds any,
 * the deepest of the rest. Hulls of more than 64 corners do not grow. Of equals the earlier one is
 * kept, so the choice is the same in every run. A NaN is less than any depth and adds no area, nor
 * does what is so far away that areas overflow. What is not kept follows in its order. Any thread
 * may call them; they need no memory. */
ODE_PARALLEL_SAP_API int dParallelSAPKeepDeepest(dContactGeom* contacts, int count, int most);
ODE_PARALLEL_SAP_API int dParallelSAPKeepSpread(dContactGeom* contacts, int count, int most);

/* Called on the calling thread, in the order of the pairs, for each pair in which one geom or both
 * are spaces. What it adds to `pairs` takes the place of that pair, for instance
 *
 *     dSpaceCollide2(o1, o2, pairs, dParallelSAPAddPair);
 *
 * and, for a model that is to collide with itself, dSpaceCollide ((dSpaceID) o1, pairs,
 * dParallelSAPAddPair); if it adds nothing the pair is passed over. It may throw, and it may do
 * with the pair what a near callback may do: such contacts of its own come before all others. */
typedef void dParallelSAPSpacesCallback(void* data, dGeomID o1, dGeomID o2, void* pairs);

/* A dNearCallback whose data are the `pairs` of a dParallelSAPSpacesCallback that is running: adds
 * a pair of geoms that are to be collided. A pair with a space is treated like those that the space
 * itself found. */
ODE_PARALLEL_SAP_API void dParallelSAPAddPair(void* pairs, dGeomID o1, dGeomID o2);

/* What dParallelSAPSpaceCollideContacts calls. */
typedef struct dParallelSAPContactCallbacks {
  dParallelSAPContactCallback* contacts; /* must be there; the others may be 0 */
  dParallelSAPFlagsCallback* flags;      /* 0: the same flags for all pairs */
  dParallelSAPReduceCallback* reduce;    /* 0: all contacts are kept */
  dParallelSAPSpacesCallback* spaces;    /* 0: dSpaceCollide2, down to pairs of geoms */
} dParallelSAPContactCallbacks;

/* In the flags of a pair: its collider runs on the calling thread, when no other does. */
enum { dParallelSAPOnCallingThread = 0x40000000 };

/* Finds the pairs as dSpaceCollide does, collides them with these flags, or those of the flags
 * callback, and reports their contacts. Without a flags callback, flags for no contact are an
 * error. `data` goes to all callbacks.
 *
 * Threads: as many as dParallelSAPSpaceSetNumThreads says, fewer where there is little to do. Each
 * gets its data by dAllocateODEDataForThread (dAllocateMaskAll), and ODE frees them when the thread
 * ends. If the space is set to manual cleanup (dSpaceSetManualCleanup), each thread but the calling
 * one calls dCleanupODEAllDataForThread before this function returns, which also frees what the
 * program had allocated for an OpenMP thread that it shares with the space. For the calling thread
 * the program has allocated the data, as for dCollide.
 *
 * Any thread collides spheres, boxes, capsules, cylinders, convexes, planes and rays with each
 * other, and meshes with these and with each other if ODE was built with OPCODE, and heightfields
 * with all of them but planes and heightfields. Meshes where dCheckConfiguration
 * ("ODE_EXT_mt_collisions") is 0 share a cache in ODE, and its collider writes to heightfields and
 * moves the other geom; so each thread collides these in a private image of ODE: the file of its
 * shared library, loaded again from memory, with variables of its own. Images are loaded when there
 * have been pairs enough to pay for it, take some 2 MB each, and stay to the end of the program.
 * What their colliders report goes to the functions that the program has set (dSetMessageHandler,
 * dSetDebugHandler, dSetErrorHandler); what they allocate does not come from those of
 * dSetAllocHandler. Where there can be none, ODE being linked statically, say, dMessage tells why,
 * once, and the calling thread collides these pairs. Calling threads, each with a space of its own,
 * take turns at the meshes that they collide without an image. Nothing protects these from threads
 * in which the program itself calls dCollide for meshes, or collides meshes with callbacks: as ODE
 * has it, no other thread may collide meshes then.
 *
 * The calling thread alone, after the others are done, collides what runs code of the program or
 * keeps something in a geom: geom transforms, user classes, meshes with callbacks or with temporal
 * coherence, meshes of GIMPACT, heightfields whose heights are a callback's, heightfields and
 * meshes where dCheckConfiguration ("ODE_EXT_mt_collisions") is 1, and pairs whose flags say so.
 * Colliders that dSetColliderOverride has put in the place of ODE's run on the calling thread, too,
 * for pairs that would be collided in an image; for others ODE does not tell: an override that is
 * not safe in many threads needs dParallelSAPOnCallingThread for its pairs. The functions for
 * messages and errors may be called from any of the threads.
 *
 * dCollide is not called for every pair. Where both geoms are spheres, capsules, boxes or planes,
 * neither CONTACTS_UNIMPORTANT nor dParallelSAPOnCallingThread is among the pair's flags, and
 * enough pairs of the last frames were worth it, pairs are first tested whether they are apart by
 * more than all errors of rounding, ODE's and the test's own; of those dCollide would find no
 * contact. The flags callback is called for them, too. An override (dSetColliderOverride) of the
 * collider of two of these classes that finds contacts of shapes that do not touch, or that counts
 * its calls, needs dParallelSAPOnCallingThread for its pairs.
 *
 * The collider of two convexes in an ODE without libccd leaves side1 and side2 of its contacts as
 * the caller had them; here they are -1.
 *
 * Memory: the contacts of all pairs, kept by the space for the next call. Where there is not
 * enough, pairs are collided and reported one by one, and the flags and reduce callbacks may be
 * called again. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollideContacts(
    dSpaceID space, void* data, int flags, const dParallelSAPContactCallbacks* callbacks);

/* Pairs in bulk: those of dSpaceCollide, in blocks instead of one by one.
 *
 *     static void takePairs(void* data, const dParallelSAPPair* pairs, size_t count, size_t first)
 *     {
 *       for (size_t i = 0; i < count; ++i) ...pairs[i].o1, pairs[i].o2...
 *     }
 *
 *     dParallelSAPSpaceCollidePairs(space, data, dParallelSAPPairsConcurrent, takePairs);
 *
 * A scene of millions of pairs spends much of a dSpaceCollide in calling the callback. Here it is
 * called once for some hundred pairs, on all threads at once if it may be. */
typedef struct dParallelSAPPair {
  dGeomID o1; /* as the near callback would get them */
  dGeomID o2; /* likewise */
} dParallelSAPPair;

/* A block of the frame's pairs, in their order; `first` is the place of pairs[0] among all pairs of
 * the frame, which count from 0. `count` is 1 or more. The pairs last until the callback returns.
 * All blocks have the same size, but for the last one, whatever the number of threads. */
typedef void dParallelSAPPairsCallback(void* data, const dParallelSAPPair* pairs, size_t count,
                                       size_t first);

/* In the flags: blocks are handed out on many threads at once, in no particular order. */
enum { dParallelSAPPairsConcurrent = 1 };

/* Finds the pairs as dSpaceCollide does, with its rules, and calls the callback for all blocks of
 * them, with the space locked. Pairs with a space in them are pairs like all others.
 *
 * Without flags the blocks come in their order, on the calling thread, and what holds for a near
 * callback holds for this one: it may throw and may collide any space.
 *
 * With dParallelSAPPairsConcurrent THE CALLBACK IS CALLED FROM MANY THREADS AT ONCE, the calling
 * one among them, in the floating-point mode of that one. It may read geoms and bodies
 * (dGeomGetData, dGeomGetAABB, dBodyIsEnabled, ...), write what belongs to its pairs alone (an
 * array by place, for instance), and collide spaces that no other thread uses, but not this one. A
 * callback that calls dCollide must have allocated its thread's data (dAllocateODEDataForThread)
 * and know which geoms other threads may collide as well: dParallelSAPSpaceCollideContacts knows.
 * If it throws, no further block is begun, and when all threads have ended theirs the exception (of
 * several, one) leaves dParallelSAPSpaceCollidePairs on the calling thread; the space is left
 * unlocked and usable. Threads: as many as dParallelSAPSpaceSetNumThreads says, fewer where there
 * are few pairs; scenes of up to 120 geoms, and those for whose pairs there is no memory, use the
 * calling thread.
 *
 * `callback` may be 0: the pairs are found and counted, and none is handed out. That is the frame
 * of a program that goes by what dParallelSAPSpaceGetBegunPairs and dParallelSAPSpaceGetEndedPairs
 * tell. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceCollidePairs(dSpaceID space, void* data, int flags,
                                                        dParallelSAPPairsCallback* callback);

/* Batches of rays, for lidars, pickers and lines of sight, on the threads of the space.
 *
 *     dParallelSAPRay rays[n] = {...};
 *     dParallelSAPRayHit hits[n];
 *     dParallelSAPSpaceRays(space, rays, n, 0, hits);
 *     for (size_t i = 0; i < n; ++i) if (hits[i].geom) ...hits[i].distance...
 *
 * does what n calls of dSpaceCollide2 do with a ray (dCreateRay, dGeomRaySet) and a near callback
 * that calls dCollide (ray, geom, ...) and keeps the nearest contact: the same hits, bit for bit,
 * whatever the number of threads. Rays go through the geoms in the order of distance and stop at
 * their nearest hit, as far as that cannot be another by errors of rounding. */
typedef struct dParallelSAPRay {
  dVector3 origin;             /* where it begins */
  dVector3 direction;          /* of any length but 0: dGeomRaySet makes it 1 */
  dReal length;                /* 0 or more */
  unsigned long category_bits; /* as dGeomSetCategoryBits. If both are 0, the ray has all bits */
  unsigned long collide_bits;  /* as dGeomSetCollideBits.  of both, as a new geom has */
} dParallelSAPRay;

/* Where a ray hits a geom. */
typedef struct dParallelSAPRayHit {
  dGeomID geom;    /* 0: the ray hits nothing */
  dReal distance;  /* from the origin: the contact's depth */
  dVector3 pos;    /* the contact's, as dCollide (ray, geom, ...) tells it */
  dVector3 normal; /* likewise */
  int side;        /* likewise, the geom's side: a mesh's triangle, or -1 */
} dParallelSAPRayHit;

/* In the flags, as dGeomRaySetFirstContact, dGeomRaySetBackfaceCull and dGeomRaySetClosestHit, for
 * all rays of the batch. The lower 16 bits are the most contacts that dCollide is asked for of each
 * geom, 0 for one. */
enum {
  dParallelSAPRayFirstContact = 0x10000,
  dParallelSAPRayBackfaceCull = 0x20000,
  dParallelSAPRayClosestHit = 0x40000
};

/* Writes the nearest hit of rays[i] to nearest[i], and returns how many rays hit something.
 * ClosestHit is always set. Of hits at the same distance that of the geom counts which was added to
 * the space earlier, and of contacts of one geom the first; a distance that is NaN is farther than
 * all others.
 *
 * A ray meets the geoms of the space that dSpaceCollide2 would report for it: those whose bounding
 * box its own overlaps, with a category/collide match, enabled. Sub-spaces are gone through like
 * dSpaceCollide2 of the ray and the sub-space would, at any depth, and their geoms stand where the
 * sub-space stands, in the order of dSpaceGetGeom; in a dSweepAndPruneSpace or dQuadTreeSpace the
 * geom that was added last stands first. What skips or adds pairs (SetSkipStatic and the
 * others) does not hold for rays.
 *
 * A ray hits nothing if a number of its origin or direction is infinite or NaN, its direction is
 * (0, 0, 0), or its length negative or NaN.
 *
 * Threads: as many as dParallelSAPSpaceSetNumThreads says, fewer for few rays; each gets its data
 * as in dParallelSAPSpaceCollideContacts. The same geoms as there are collided by the calling
 * thread only, or in images of ODE. The space is locked meanwhile.
 *
 * A collider that dSetColliderOverride has put in the place of ODE's for rays with spheres, boxes,
 * capsules or cylinders may be called from any thread, and is not called for geoms that the ray
 * passes or that are behind its nearest hit; if it finds hits there, they are not found. Rotation
 * matrices that dGeomSetRotation was given need not be exact: geoms of which they are not one cost
 * more, not hits.
 *
 * Memory: trees over the geoms, kept by the space while rays come. Where there is not enough, rays
 * are cast one by one. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRays(dSpaceID space, const dParallelSAPRay* rays,
                                                  size_t count, int flags,
                                                  dParallelSAPRayHit* nearest);

/* The hits of a ray, the nearest first, equal ones in the order above; `ray` is its place among all
 * rays. They last until the callback returns. It may do what a near callback may do, throw too. */
typedef void dParallelSAPRayCallback(void* data, size_t ray, const dParallelSAPRayHit* hits,
                                     size_t count);

/* All hits instead of the nearest: calls the callback for each ray that has any, in the order of
 * the rays, on the calling thread, with the space locked, when all hits have been found. Returns
 * their number. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceRayHits(dSpaceID space, const dParallelSAPRay* rays,
                                                     size_t count, int flags, void* data,
                                                     dParallelSAPRayCallback* callback);

/* Which pairs began and which ended, and a number for each pair while it lasts.
 *
 * Nonzero: each dSpaceCollide, dParallelSAPSpaceCollidePairs and dParallelSAPSpaceCollideContacts
 * of this space is compared with the one before. A pair that was not there before has begun, one
 * that is there no more has ended, all others last. Pairs are the geoms of this space that are
 * reported together, as they are reported: bounding boxes that overlap, by all rules that are set;
 * a sub-space is one geom. Geoms count from when they were last added: a pair of a geom that was
 * removed and added again has ended and begun. When events are switched on no pair is there yet, so
 * that the next collide begins them all; when they are switched off nothing is told of those that
 * there are. Default: 0, and then nothing is held or compared.
 *
 * What a collide found is known before its first pair is reported: to the callback, and after it
 * until the next collide finds its pairs, whether the callback throws or not. A collide within a
 * callback of this space (another one's pairs of the same moment) tells nothing and changes nothing
 * of what was told. Nor does dSpaceCollide2. Where there is no memory, dMessage says so once,
 * nothing is told of that collide, and the next one is compared with the last that was told.
 *
 * Cost: none worth naming where no geom changed and the pairs are those kept from the last frame.
 * Where few changed it is known from these what began and ended, and if any did, the numbers of all
 * pairs are copied. Otherwise each pair is compared with the last frame's as well, on the threads
 * of the space. Memory: 4 bytes a pair, 16 where pairs begin or end. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetEvents(dSpaceID space, int on);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetEvents(dSpaceID space);

/* A pair that began or ended.
 *
 * `number` is the pair's own from its first to its last collide, and still when it has ended, so an
 * array with room for so many numbers can hold what the program keeps of its pairs. A pair that
 * begins gets the lowest number that is free, in the order of the pairs; one that ended in a
 * collide is free from the next one on. No number is as large as the most pairs that a collide
 * found and ended together so far. */
typedef struct dParallelSAPPairEvent {
  dGeomID o1;   /* as reported. Of an ended pair 0 where the geom has left the space since, for
                 * another one, too: it may not exist any more */
  dGeomID o2;   /* likewise */
  size_t place; /* among all pairs of the collide; of an ended one, of the last in which it was */
  unsigned number; /* as long as the pair lasts */
} dParallelSAPPairEvent;

/* The pairs that began, in the order of the pairs, or ended, in that in which they were reported
 * last. Set *pairs to the first and return their number; if that is 0, *pairs is 0. They belong to
 * the space and stay until its next collide; geoms that are destroyed before are still named. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetBegunPairs(dSpaceID space,
                                                           const dParallelSAPPairEvent** pairs);
/* Likewise of those that ended. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetEndedPairs(dSpaceID space,
                                                           const dParallelSAPPairEvent** pairs);

/* The numbers of all pairs of the last collide by place, for dParallelSAPSpaceCollidePairs the
 * place of the block's first pair and those after it; those that are not among the begun ones last.
 * As above; 0 of them where nothing was told. May be read from many threads. */
ODE_PARALLEL_SAP_API size_t dParallelSAPSpaceGetPairNumbers(dSpaceID space,
                                                            const unsigned** numbers);

/* Looks for a pair of the last collide, given in any order, in time that grows with the logarithm
 * of their number: 1, and its number in *number, or 0. It may be called from a contact callback,
 * and, while no geom is added or removed, from many threads. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceFindPair(dSpaceID space, dGeomID o1, dGeomID o2,
                                                   unsigned* number);

/* Nonzero: pairs in which neither geom has a body are not found. ODE's spaces report them, so the
 * default is 0. A space inside this one never counts as static: its geoms may have bodies. Static
 * geoms that do not move then cost nothing in a frame, however many they are. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSkipStatic(dSpaceID space, int skip);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetSkipStatic(dSpaceID space);

/* Nonzero: pairs with at least one body, all of whose bodies are disabled (dBodyDisable, automatic
 * disabling), are not found. A body that is enabled again, in whatever way, has its pairs in the
 * next collide. A space inside this one counts as awake. Default: 0. Both settings hold for
 * all collides of this space but dSpaceCollide2. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSkipAsleep(dSpaceID space, int skip);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetSkipAsleep(dSpaceID space);

/* Nonzero: the program promises to tell the space of what ODE tells no space, so that a frame needs
 * not look at each geom to see it: where little changes, that is most of a frame. Default: 0. Of a
 * geom in this space it is to be told, after the call or before, but before the next collide, that
 *
 * - its category or collide bits are others (dGeomSetCategoryBits, dGeomSetCollideBits);
 * - it was enabled or disabled (dGeomEnable, dGeomDisable);
 * - its body was taken away (dGeomSetBody (geom, 0), dBodyDestroy, dWorldDestroy); of a new body
 *   ODE tells;
 * - under SetSkipAsleep, its body was woken by a call (dBodyEnable; dBodySetAutoDisableFlag and
 *   dBodySetAutoDisableDefaults wake a body that they do not let sleep). Bodies that a call or a
 *   step puts to sleep, and those that a step wakes, need not be told of: where that may happen the
 *   space looks at the bodies that are awake.
 *
 * What moves a geom, changes its size, adds or removes it is told by ODE. A promise that is not
 * kept may cost pairs or leave some that are no more, until the geom moves.
 * ODE_PARALLEL_SAP_NOTIFIED=check finds it out. The promise counts from the call on, for all geoms
 * there are and will be. Pairs and their order are the same with and without it. It has no effect
 * where every frame is found anew: on the CUDA back end, by a method that was asked for by name,
 * Sweep apart; and scenes of up to 120 geoms are looked at all the same. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetNotified(dSpaceID space, int notified);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetNotified(dSpaceID space);

/* Tells the space that a geom of it may have changed in such a way, or, with `geom` 0, that any of
 * its geoms may have: the next frame looks at it, or at all. Without SetNotified it has no effect.
 * May be called in callbacks, where the geom may be changed there, and for geoms from many threads
 * at once while nothing else is done with the space, so as those calls of ODE may be made. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceNotify(dSpaceID space, dGeomID geom);

/* How far apart two bounding boxes may be on each axis and be reported all the same, in units of
 * length: 0 or more, finite. Default: 0, no pair but those that overlap. No pair that overlaps is
 * ever missed. What it buys: geoms that have moved by less than a quarter of it since their boxes
 * were last looked at are not looked at again, and no pair needs the exact test. That is some
 * nanoseconds a geom, since pairs that may come to overlap are kept without a tolerance too, and an
 * additional pair of boxes costs a callback that calls dCollide some 200: it pays where little is
 * done for a pair, and hardly elsewhere (examples/tradeoff measures it). Which of the
 * additional pairs are reported depends on the frames before; the same calls still give the same
 * pairs. Holds for all collides of this space but dSpaceCollide2. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetTolerance(dSpaceID space, dReal distance);
ODE_PARALLEL_SAP_API dReal dParallelSAPSpaceGetTolerance(dSpaceID space);

/* A trace: every `every`-th dSpaceCollide, dParallelSAPSpaceCollideContacts and
 * dParallelSAPSpaceCollidePairs of this space, from the next one on, writes to the file `path` what
 * geoms there are, at any depth, with their classes, sizes, bits, bodies, poses and bounding boxes,
 * and how many pairs it found; later frames only what changed. The file can be replayed without the
 * program: by any method, back end and number of threads its pairs are those that the program had,
 * but for a tolerance or a class's AABBTest. Its format is public (space/trace/README.md in the
 * sources).
 *
 * Returns 1, or 0 where the file cannot be made; a file of that name is written over. Any
 * call ends the trace that there was, also where the new file cannot be made; `path` 0 only ends
 * it, and returns 1, as does the end of the space. Two spaces must not write one file. What is
 * written is in the file when the collide returns. Where writing fails later, a full disk say,
 * dMessage says so once, the file ends with its last whole frame, and the program goes on. GetTrace
 * answers `every`, or 0 where no trace is being written.
 *
 * The geoms of a frame that is written are brought up to date before it begins, as by dSpaceClean:
 * its statistics count none of them as moved and do not count the time it takes to write. A collide
 * within a callback of this space is not written. Not to be called while the space is locked. The
 * child of a fork writes nothing. Meshes, heightfields, convex hulls and user classes are written
 * with their bounding boxes only, and of an AABBTest of a user's class nothing is known. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceSetTrace(dSpaceID space, const char* path, int every);
ODE_PARALLEL_SAP_API int dParallelSAPSpaceGetTrace(dSpaceID space);

/* Swept bounds: the bounding box of each geom of this space covers what the geom will move in the
 * coming step, `step` seconds long, 0 or more, finite, so that a program's own continuous test, or
 * a step in parts, sees the pairs of fast bodies in time. Default: 0, boxes as geoms lie.
 *
 * Where a geom's body is enabled and moves, its box is made thus, in dReal, of the velocities that
 * the body has when the collide begins: with d = linear velocity * step and a = the lesser of
 * |angular velocity| * step and 2, the lower bounds are those of dGeomGetAABB + min (d, 0) - a * r,
 * the upper ones + max (d, 0) + a * r, axis by axis. r is the distance from the body's position to
 * the farthest corner of that box, for spheres to their centre. So the box covers the geom at every
 * moment of a step at these velocities, for ODE's ways to step a rotation, too; it does not cover
 * what forces, gravity and contacts of that step add to them: for g * step^2 of it set a step some
 * parts longer, or give bodies their velocities beforehand. A product that is a NaN counts as 0.
 * Geoms without body, of disabled bodies and sub-spaces keep their boxes; that of a sub-space is
 * the box around those in it, swept if it is a space like this one that has a step of its own.
 *
 * Everything that this space finds it finds with these boxes: all methods and back ends,
 * dSpaceCollide2, events, AABBTest, the rules below and above, and a tolerance comes on top. Pairs
 * are those of the formula above for them, in the same order: more than without, never one less.
 * (A geom or sub-space that another one of these spaces is asked about by dSpaceCollide2 comes with
 * its swept box.) Around a swept space, at any depth and through stock spaces between, a space like
 * this one takes every sub-space with its box as it is then. A stock space sweeps nothing: it takes
 * what is swept in it with the box this was given last, by a collide, dSpaceClean, rays or
 * dSpaceCollide2 of the swept space or of one like it around, or where geoms in it have moved
 * since. So a stock space misses no pair of geoms as they lie, but sees one of faster bodies late;
 * and nothing that is swept within it puts its geoms into another order.
 *
 * The boxes are the geoms' own: dGeomGetAABB gives the swept one after a collide, until the geom
 * moves or leaves the space, or its body's velocity or enabled state changes and the space is asked
 * again. Some of ODE's colliders read it: those of heightfields, of a convex with a mesh, and, in
 * builds with GIMPACT, of a box or cylinder with a mesh. They may find other contacts of the pair,
 * or in another order. dCollide and dParallelSAPSpaceCollideContacts find contacts of geoms as they
 * lie: pairs that only swept boxes make have none.
 *
 * Cost: none where it is 0. Otherwise every collide looks at the velocities of all geoms, since ODE
 * tells no space of them, and makes the boxes of those that move or moved on the calling thread. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceSetSweptBounds(dSpaceID space, dReal step);
ODE_PARALLEL_SAP_API dReal dParallelSAPSpaceGetSweptBounds(dSpaceID space);

/* Whether a geom of this space is fast: 1 if |d| + a * r, by which no point of it moves further,
 * was more than half of its smallest side when its box was last made: by a collide, dSpaceClean,
 * rays or dSpaceCollide2. (That side is, of spheres, boxes, capsules and cylinders, that of the
 * shape, of all others that of the box dGeomGetAABB gives without swept bounds.) Such a geom might
 * be through something before it is seen to touch it. 0 for all other geoms, those of other spaces
 * too, and without swept bounds; 1 for all after a frame without memory to record it, until one
 * that has it. A callback that steps the pairs of fast geoms in parts, or tests them continuously,
 * can leave all others to dCollide. May be called from many threads. */
ODE_PARALLEL_SAP_API int dParallelSAPSpaceIsFast(dSpaceID space, dGeomID geom);

/* What the last dSpaceCollide, dParallelSAPSpaceCollideContacts or dParallelSAPSpaceCollidePairs on
 * a space did. Times are wall-clock milliseconds; a stage that had nothing to do has 0. */
typedef struct dParallelSAPStats {
  unsigned long long frames;     /* such calls on this space so far */
  size_t geoms;                  /* geoms in the space */
  size_t moved;                  /* geoms whose AABB was brought up to date */
  size_t disabled;               /* geoms left out: disabled, zero-sized or an empty sub-space;
                                  * under SetSkipStatic, geoms without body as when last moved */
  size_t invalid;                /* geoms left out: a NaN bound */
  size_t unbounded;              /* geoms with an infinite or inverted AABB */
  unsigned long long candidates; /* pairs that were found in this frame, before the filter */
  unsigned long long pairs;      /* pairs reported to the callback, or collided for contacts */
  unsigned long long contacts;   /* contacts reported to the contact callback */
  int backend;                   /* what ran: dParallelSAPBackendCPU or dParallelSAPBackendCUDA */
  int method;                    /* what ran: a dParallelSAPMethod, never Auto */
  int threads;                   /* threads used by the widest stage */
  int devices;                   /* GPUs used */
  double update_ms;              /* AABBs of the geoms that moved */
  double synchronise_ms;         /* the threads' boxes made one set */
  double extract_ms;             /* overlapping pairs, in the order of the report */
  double filter_ms;              /* exact test of borderline pairs, AABBTest calls */
  double narrow_ms;              /* the contacts of all pairs */
  double report_ms;              /* the near, contact or pairs callback, with all that it did */
  double total_ms;               /* the whole call */
  size_t memory_bytes;           /* held by the space for its own structures, the geoms apart */
  unsigned long long kept;       /* pairs found in an earlier frame, not looked for again. None, and
                                  * every frame is found anew, where a geom has category or collide
                                  * bits above the lowest 32 (1ul << 40) but not all from the 32nd on
                                  * (~8ul) */
  double events_ms;              /* which pairs began and ended, if that is asked for */
  unsigned long long apart;      /* pairs that dCollide was not called for since they are certainly
                                  * apart; none in frames in which too few were to look for them */
  int find_threads;              /* threads used by the widest stage that finds pairs */
  int narrow_threads;            /* threads that found contacts; 0 where none were to be found */
  unsigned long long candidates_kept; /* pairs of boxes with some room to move in, found in an
                                       * earlier frame, among which the pairs of this one were
                                       * looked for; none where geoms move far */
} dParallelSAPStats;

/* Fills *stats; all zero before the first collide. Scenes of up to 120 geoms are not timed before
 * this has been called once, and then in every sixteenth frame: the clock would be a good part of
 * what it measures. Their times are those of the last frame that was timed, and extract_ms is all
 * that comes before the report. Likewise timed in every sixteenth frame are those without a report
 * (dParallelSAPSpaceCollidePairs without a callback) of a space that is told of changes
 * (dParallelSAPSpaceSetNotified) and has no tolerance, as long as there are none. */
ODE_PARALLEL_SAP_API void dParallelSAPSpaceGetStats(dSpaceID space, dParallelSAPStats* stats);

/* Environment variables, read when a space is created, take the place of the defaults above in
 * programs that set nothing: ODE_PARALLEL_SAP_BACKEND=auto|cpu|cuda,
 * ODE_PARALLEL_SAP_METHOD=auto|sweep|brute-force|axis-lists, ODE_PARALLEL_SAP_THREADS=n,
 * ODE_PARALLEL_SAP_DEVICES=n; ODE_PARALLEL_SAP_SKIP_STATIC=0|1, ODE_PARALLEL_SAP_SKIP_ASLEEP=0|1,
 * ODE_PARALLEL_SAP_CULL_PLANES=0|1 and ODE_PARALLEL_SAP_TOLERANCE=distance, which change what is
 * reported as dParallelSAPSpaceSetSkipStatic and so on do; ODE_PARALLEL_SAP_NOTIFIED=0|1|check, of
 * which 1 is a dParallelSAPSpaceSetNotified, and with check every space that has that promise looks
 * at all its geoms in each frame nevertheless, goes by what it finds, and says once through
 * dMessage if it was not told of a change; ODE_PARALLEL_SAP_STATS=1 (or 0) prints
 * through dMessage, when a space is destroyed, what its frames had to do and where their time went,
 * and what its queries (dSpaceCollide2) and rays took;
 * and in a last line, if a hundredth or more of that time would have been saved by it, which of
 * these variables would have saved how much of it, or which categories of geoms never touched and
 * could do without each other. That is an estimate, made from a sample of the pairs, from what
 * callbacks took for them, and from the times of the stages. A value that is not understood or not
 * to be had is reported through dMessage and ignored.
 *
 * ODE_PARALLEL_SAP_SIMD=portable|sse2|avx2|avx512|neon, read at the same moment, is for tests and
 * comparisons: the instruction set of the inner loops, for all spaces of the process from then on,
 * where otherwise the best one is taken that the processor has. ODE_PARALLEL_SAP_STATS=1 names it.
 * Pairs and their order do not depend on it.
 *
 * ODE_PARALLEL_SAP_TRACE=path[:every], read at the same moment, is a dParallelSAPSpaceSetTrace for
 * each space that collides: the first one to do so writes `path`, the next ones path.2, path.3 and
 * so on. %p in the path is replaced by the process's number; only with it the child of a fork
 * writes traces, too.
 *
 * libode-parallel-sap-preload.so, named in LD_PRELOAD, makes this space wherever a program asks for
 * one of ODE's: ODE_PARALLEL_SAP_REPLACE, a comma list of hash, sap, quadtree (these by default)
 * and simple, says for which, and ODE_PARALLEL_SAP_STATS=1 prints to stderr at the program's end
 * what was replaced and where the time of all these spaces went. What it does not understand it
 * says on stderr. While such a space reports, dCollide answers with contacts that were found on all
 * threads beforehand, bit for bit those of ODE: ODE_PARALLEL_SAP_CONTACTS=auto|off|on says whether
 * they are. auto, the default, finds them where the program asked for those of enough of the last
 * frame's pairs, by several threads; on finds them whether that pays or not. */

#ifdef __cplusplus
}
#endif

#endif
