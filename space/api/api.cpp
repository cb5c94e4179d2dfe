// The C functions of the public header.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <utility>

#include "space/contacts/contact_pairs.h"
#include "space/facts/facts.h"
#include "space/finders/extraction.h"
#include "space/geoms/geom_tests.h"
#include "space/ode/ode_space.h"
#include "space/rays/swept_contacts.h"
#include "space/trace/trace.h"

using namespace ode_parallel_sap;

namespace {

// `caller`: the function that these are called from, for the message.
ParallelSAPSpace& checked(dSpaceID space, const char* caller = __builtin_FUNCTION()) {
  ParallelSAPSpace* const own = parallelSAPSpace(space);
  require(own, "argument not a parallel SAP space", caller);
  return *own;
}

bool isLength(dReal value) {
  return value >= 0 && value <= std::numeric_limits<dReal>::max();
}

// Spaces that are asked for events: those without say so.
Pipeline& withPairs(dSpaceID space, const char* caller = __builtin_FUNCTION()) {
  Pipeline& own = checked(space, caller).pipeline();
  if (!(own.eventKinds() & dParallelSAPEventPairs))
    own.complaints.ofEventsOff(caller, "dParallelSAPEventPairs");
  return own;
}

Pipeline& withTouches(dSpaceID space, const char* caller = __builtin_FUNCTION()) {
  Pipeline& own = checked(space, caller).pipeline();
  if (!(own.eventKinds() & dParallelSAPEventTouches))
    own.complaints.ofEventsOff(caller, "dParallelSAPEventTouches");
  else if (own.touches().lastHadNoContacts())
    own.complaints.ofNoContacts(caller);
  return own;
}

// Of version 0.1.
constexpr std::size_t old_ray_size =
    offsetof(dParallelSAPRay, collide_bits) + sizeof(dParallelSAPRay::collide_bits);

std::size_t castRays(dSpaceID space, std::size_t hit_size, const RayRequest& request,
                     const char* caller) {
  ParallelSAPSpace& own = checked(space, caller);
  const bool is_known =
      request.ray_size == sizeof(dParallelSAPRay) || request.ray_size == old_ray_size;
  require(is_known && hit_size == sizeof(dParallelSAPRayHit),
          "rays or hits of another version of this header", caller);
  constexpr int known = 0xffff | dParallelSAPRayFirstContact | dParallelSAPRayBackfaceCull |
                        dParallelSAPRayClosestHit;
  require(request.rays || request.count == 0, "no rays", caller);
  require((request.flags & ~known) == 0, "unknown flags for rays", caller);
  require(request.nearest || request.all || request.count == 0, "no place for hits", caller);
  return own.castRays(request);
}

}  // namespace

// The header makes a macro of this name. The function is for dlsym and older programs.
dSpaceID(dParallelSAPSpaceCreate)(dSpaceID parent) {
  return dParallelSAPSpaceCreateSized(sizeof(dReal), dCloseODE, parent);
}

dSpaceID dParallelSAPSpaceCreateSized(size_t real_size, void (*ode)(), dSpaceID parent) {
  constexpr const char* name = "dParallelSAPSpaceCreate";
  require(real_size == sizeof(dReal),
          sizeof(dReal) == sizeof(double)
              ? "the program is compiled for single precision, ODE and this library for double"
              : "the program is compiled for double precision, ODE and this library for single",
          name);
  // A function has one address in a process, whichever library asks for it.
  require(ode == dCloseODE,
          "the program has an ODE of its own beside that of libode-parallel-sap: link both with "
          "the same shared ODE, or build both libraries static",
          name);
  require(!parent || IS_SPACE(parent), "parent is not a space", name);
  auto* const space = new ParallelSAPSpace(parent);
  SpaceObservers& observers = space->pipeline().observers;
  if (auto trace = Trace::fromEnvironment()) observers.add(std::move(trace));
  if (space->settings().print_stats) observers.add(std::make_unique<PrintedFacts>(*space));
  return space;
}

int dSpaceIsParallelSAP(dSpaceID space) {
  dAASSERT(space);
  return parallelSAPSpace(space) != nullptr;
}

void dParallelSAPClassHasNoAABBTest(int geom_class) {
  const bool known = geom_class >= dFirstUserClass && geom_class <= dLastUserClass;
  dUASSERT(known, "not a class of dCreateGeomClass");
  if (known) untested_classes |= 1u << (geom_class - dFirstUserClass);
}

int dParallelSAPSpaceSetBackend(dSpaceID space, int backend) {
  ParallelSAPSpace& own = checked(space);
  const bool known = backend >= dParallelSAPBackendAuto && backend <= dParallelSAPBackendCUDA;
  dUASSERT(known, "no such back end");
  if (!known || (backend == dParallelSAPBackendCUDA && !deviceAvailable())) return 0;
  own.settings().backend = backend;
  return 1;
}

int dParallelSAPSpaceSetMethod(dSpaceID space, int method) {
  ParallelSAPSpace& own = checked(space);
  const bool known = method >= dParallelSAPMethodAuto && method <= dParallelSAPMethodAxisLists;
  dUASSERT(known, "no such method");
  if (known) own.settings().method = method;
  return known;
}

void dParallelSAPSpaceSetNumThreads(dSpaceID space, int n) {
  ParallelSAPSpace& own = checked(space);
  dUASSERT(n >= 0, "negative number of threads");
  own.settings().threads = std::min(n, most_threads);
}

void dParallelSAPSpaceSetNumDevices(dSpaceID space, int n) {
  ParallelSAPSpace& own = checked(space);
  dUASSERT(n >= 0, "negative number of devices");
  own.settings().devices = n;
}

void dParallelSAPSpaceCollideContactsSized(size_t size, dSpaceID space, void* data, int flags,
                                           const dParallelSAPContactCallbacks* callbacks) {
  constexpr const char* name = "dParallelSAPSpaceCollideContacts";
  ParallelSAPSpace& own = checked(space, name);
  require(callbacks, "no callbacks", name);
  dParallelSAPContactCallbacks known = {};
  const char* const bytes = reinterpret_cast<const char*>(callbacks);
  const std::size_t known_size = std::min(size, sizeof known);
  std::memcpy(&known, bytes, known_size);
  require(std::all_of(bytes + known_size, bytes + size, [](char byte) { return byte == 0; }),
          "callbacks that this version of the library does not know", name);
  require(known.contacts, "no contact callback", name);
  require(known.flags || (flags & 0xffff) != 0, "flags for no contact", name);
  own.collideContacts({data, flags, known});
}

// The header makes a macro of this name. The function is for programs that were compiled with
// version 0.1, whose struct ends with `spaces`.
void(dParallelSAPSpaceCollideContacts)(dSpaceID space, void* data, int flags,
                                       const dParallelSAPContactCallbacks* callbacks) {
  constexpr std::size_t size =
      offsetof(dParallelSAPContactCallbacks, spaces) + sizeof callbacks->spaces;
  dParallelSAPSpaceCollideContactsSized(size, space, data, flags, callbacks);
}

void dParallelSAPSpaceCollidePairs(dSpaceID space, void* data, int flags,
                                   dParallelSAPPairsCallback* callback) {
  ParallelSAPSpace& own = checked(space);
  dUASSERT((flags & ~dParallelSAPPairsConcurrent) == 0, "unknown flags for pairs");
  own.collidePairs({data, flags, callback});
}

size_t dParallelSAPSpaceRaysSized(size_t ray_size, size_t hit_size, dSpaceID space,
                                  const dParallelSAPRay* rays, size_t count, int flags,
                                  dParallelSAPRayHit* nearest) {
  return castRays(space, hit_size, {rays, ray_size, count, flags, nearest, nullptr, nullptr},
                  "dParallelSAPSpaceRays");
}

size_t dParallelSAPSpaceRayHitsSized(size_t ray_size, size_t hit_size, dSpaceID space,
                                     const dParallelSAPRay* rays, size_t count, int flags,
                                     void* data, dParallelSAPRayCallback* callback) {
  return castRays(space, hit_size, {rays, ray_size, count, flags, nullptr, data, callback},
                  "dParallelSAPSpaceRayHits");
}

// Likewise.
size_t(dParallelSAPSpaceRays)(dSpaceID space, const dParallelSAPRay* rays, size_t count, int flags,
                              dParallelSAPRayHit* nearest) {
  return dParallelSAPSpaceRaysSized(old_ray_size, sizeof *nearest, space, rays, count, flags,
                                    nearest);
}

size_t(dParallelSAPSpaceRayHits)(dSpaceID space, const dParallelSAPRay* rays, size_t count,
                                 int flags, void* data, dParallelSAPRayCallback* callback) {
  return dParallelSAPSpaceRayHitsSized(old_ray_size, sizeof(dParallelSAPRayHit), space, rays, count,
                                       flags, data, callback);
}

size_t dParallelSAPSpaceOverlaps(dSpaceID space, dParallelSAPProbe* probes, size_t count,
                                 size_t size, int flags, void* data,
                                 dParallelSAPOverlapCallback* callback) {
  ParallelSAPSpace& own = checked(space);
  constexpr int of_ode = 0xffff | static_cast<int>(CONTACTS_UNIMPORTANT);
  const bool any = flags & dParallelSAPOverlapAny;
  dUASSERT(probes || count == 0, "no probes");
  dUASSERT(size == sizeof *probes, "probes of another version of this header");
  dUASSERT((flags & ~(of_ode | dParallelSAPOverlapAny)) == 0, "unknown flags for overlaps");
  dUASSERT(!any || !callback, "a callback without all overlaps");
  flags &= of_ode;
  return own.findOverlaps({probes, count, flags & 0xffff ? flags : flags | 1, any, data, callback});
}

void dParallelSAPSpaceSetQueryFilter(dSpaceID space, dParallelSAPQueryFilter* filter, void* data) {
  checked(space).setQueryFilter({filter, data});
}

int dParallelSAPSpaceSetTrace(dSpaceID space, const char* path, int every) try {
  ParallelSAPSpace& own = checked(space);
  dUASSERT(every >= 1 || !path, "a trace is written of every n-th collide, n >= 1");
  dUASSERT(!own.isLocked(), "invalid operation for locked space");
  SpaceObservers& observers = own.pipeline().observers;
  observers.remove(observers.find<Trace>());
  if (!path || every < 1) return !path;
  auto trace = std::make_unique<Trace>(every);
  if (!trace->open(path)) return 0;
  observers.add(std::move(trace));
  return 1;
} catch (const std::bad_alloc&) {
  return 0;
}

int dParallelSAPSpaceGetTrace(dSpaceID space) {
  const auto* const trace = checked(space).pipeline().observers.find<Trace>();
  return trace ? trace->every() : 0;
}

void dParallelSAPSpaceSetEvents(dSpaceID space, int events) {
  ParallelSAPSpace& own = checked(space);
  const bool known = (events & ~(dParallelSAPEventPairs | dParallelSAPEventTouches)) == 0;
  dUASSERT(known, "unknown events");
  if (known) own.pipeline().turnEvents(events);
}

int dParallelSAPSpaceGetEvents(dSpaceID space) {
  return checked(space).pipeline().eventKinds();
}

size_t dParallelSAPSpaceGetPairNumbers(dSpaceID space, const unsigned** numbers) {
  dAASSERT(numbers);
  const PairEvents& events = withPairs(space).events();
  *numbers = events.pairs() ? events.numbers() : nullptr;
  return events.pairs();
}

int dParallelSAPSpaceFindPair(dSpaceID space, dGeomID o1, dGeomID o2, unsigned* number) {
  const PairEvents& events = withPairs(space).events();
  dAASSERT(o1 && o2 && number);
  if (dGeomGetSpace(o1) != space || dGeomGetSpace(o2) != space) return 0;
  const std::size_t place = events.placeOf(Slots::slotOf(o1), Slots::slotOf(o2));
  if (place == events.pairs()) return 0;
  *number = events.numbers()[place];
  return 1;
}

void dParallelSAPAddPair(void* pairs, dGeomID o1, dGeomID o2) {
  dAASSERT(pairs && o1 && o2);
  static_cast<ContactPairs*>(pairs)->add(o1, o2);
}

void dParallelSAPSpaceNotify(dSpaceID space, dGeomID geom) {
  ParallelSAPSpace& own = checked(space);
  dUASSERT(!geom || dGeomGetSpace(geom) == space, "geom is not in this space");
  own.pipeline().notify(geom);
}

#define EVENTS(get, with, list)                                      \
  size_t get(dSpaceID space, const dParallelSAPPairEvent** events) { \
    dAASSERT(events);                                                \
    const Buffer<dParallelSAPPairEvent>& all = with(space).list();   \
    *events = all.size() ? all.data() : nullptr;                     \
    return all.size();                                               \
  }
#define GETTER(type, get, setting)            \
  type get(dSpaceID space) {                  \
    return checked(space).settings().setting; \
  }
#define SWITCH(set, get, setting)                \
  void set(dSpaceID space, int on) {             \
    checked(space).settings().setting = on != 0; \
  }                                              \
  GETTER(int, get, setting)

EVENTS(dParallelSAPSpaceGetBegunPairs, withPairs, events().begun)
EVENTS(dParallelSAPSpaceGetEndedPairs, withPairs, events().ended)
EVENTS(dParallelSAPSpaceGetBegunTouches, withTouches, touches().begun)
EVENTS(dParallelSAPSpaceGetEndedTouches, withTouches, touches().ended)
GETTER(int, dParallelSAPSpaceGetBackend, backend)
GETTER(int, dParallelSAPSpaceGetMethod, method)
GETTER(int, dParallelSAPSpaceGetNumThreads, threads)
GETTER(int, dParallelSAPSpaceGetNumDevices, devices)
GETTER(dReal, dParallelSAPSpaceGetTolerance, rules.tolerance)
SWITCH(dParallelSAPSpaceSetSkipStatic, dParallelSAPSpaceGetSkipStatic, rules.skip_static)
SWITCH(dParallelSAPSpaceSetSkipAsleep, dParallelSAPSpaceGetSkipAsleep, rules.skip_asleep)
SWITCH(dParallelSAPSpaceSetCullPlanes, dParallelSAPSpaceGetCullPlanes, rules.cull_planes)
SWITCH(dParallelSAPSpaceSetNotified, dParallelSAPSpaceGetNotified, rules.notified)

void dParallelSAPSpaceSetTolerance(dSpaceID space, dReal distance) {
  ParallelSAPSpace& own = checked(space);
  dUASSERT(isLength(distance), "tolerance is not a length");
  own.settings().rules.tolerance = distance;
}

void dParallelSAPSpaceSetSweptBounds(dSpaceID space, dReal step) {
  ParallelSAPSpace& own = checked(space);
  dUASSERT(isLength(step), "step is not a time");
  own.setSweptBounds(step);
}

dReal dParallelSAPSpaceGetSweptBounds(dSpaceID space) {
  return checked(space).sweptBounds();
}

int dParallelSAPSpaceIsFast(dSpaceID space, dGeomID geom) {
  const ParallelSAPSpace& own = checked(space);
  dAASSERT(geom);
  const bool is_own = dGeomGetSpace(geom) == space;
  dUASSERT(is_own, "geom is not in this space");
  return is_own && own.isFast(geom);
}

int dParallelSAPCollideSwept(dGeomID o1, dGeomID o2, dReal step, int flags, dContactGeom* contacts,
                             int skip) {
  dAASSERT(o1 && o2 && contacts);
  dUASSERT(!IS_SPACE(o1) && !IS_SPACE(o2), "a geom is a space");
  dUASSERT(isLength(step), "step is not a time");
  dUASSERT((flags & 0xffff) > 0, "flags for no contact");
  dUASSERT(skip >= static_cast<int>(sizeof *contacts), "skip is less than the size of a contact");
  return collideSwept(o1, o2, step, flags, contacts, skip);
}

void dParallelSAPSpaceGetStatsSized(size_t size, dSpaceID space, dParallelSAPStats* stats) {
  constexpr const char* name = "dParallelSAPSpaceGetStats";
  ParallelSAPSpace& own = checked(space, name);
  require(stats, "no statistics to fill", name);
  const std::size_t known_size = std::min(size, sizeof *stats);
  const dParallelSAPStats last = own.stats();
  std::memcpy(stats, &last, known_size);
  std::memset(reinterpret_cast<char*>(stats) + known_size, 0, size - known_size);
}

// Likewise: in version 0.1 the struct ends with `candidates_kept`.
void(dParallelSAPSpaceGetStats)(dSpaceID space, dParallelSAPStats* stats) {
  constexpr std::size_t size =
      offsetof(dParallelSAPStats, candidates_kept) + sizeof stats->candidates_kept;
  dParallelSAPSpaceGetStatsSized(size, space, stats);
}
