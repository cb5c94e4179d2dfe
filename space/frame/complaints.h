// Messages of a space to the program, through dMessage, each of them once.
#pragma once

#include <ode/ode.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <new>
#include <unordered_set>
#include <utility>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"

namespace ode_parallel_sap {

class Complaints {
 public:
  // Where there is no memory to note that it was said, rather once more than not at all. Queries
  // may say it on any thread.
  void ofInvalid(const dxGeom* geom) {
    static std::mutex mutex;
    bool first = true;
    try {
      const std::lock_guard<std::mutex> lock(mutex);
      first = !made(invalid_) || invalid_->insert(geom).second;
    } catch (const std::bad_alloc&) {
    }
    if (first)
      dMessage(0, "parallel SAP space: geom %p has a NaN in its AABB and is left out of all pairs",
               static_cast<const void*>(geom));
  }
  // The geom is gone: another one may come to its address.
  void forget(const dxGeom* geom) {
    if (invalid_) invalid_->erase(geom);
  }
  void ofThreads(const void* space) {
    if (!two_threads_.exchange(true))
      dMessage(0,
               "parallel SAP space %p: a thread uses it while another one does, or has left a "
               "callback of it by longjmp",
               space);
  }
  void ofUnannounced(const dxGeom* geom, std::size_t count) {
    if (!std::exchange(unannounced_, true))
      dMessage(0,
               "parallel SAP space: %zu geoms changed, geom %p first, without the call of "
               "dParallelSAPSpaceNotify that dParallelSAPSpaceSetNotified promises",
               count, static_cast<const void*>(geom));
  }
  void ofTooLong(const ListsTooLong& lists) {
    if (!std::exchange(too_long_, true))
      dMessage(0,
               "parallel SAP space: the method AxisLists would need %.1f MB for the pairs of each "
               "axis and may take %.1f MB; the method Sweep is used where it does not fit",
               static_cast<double>(lists.needed) / 1e6, static_cast<double>(lists.allowed) / 1e6);
  }
  void ofNoMemory() {
    if (!std::exchange(no_memory_, true))
      dMessage(0, "parallel SAP space: out of memory, pairs are found for some geoms at a time");
  }
  void ofUnreportedEvents() {
    if (!std::exchange(unreported_events_, true))
      dMessage(0,
               "parallel SAP space: out of memory, a later frame reports the pairs that began "
               "and ended");
  }
  // On any thread.
  void ofEventsOff(const char* function, const char* kind) {
    if (!events_off_.exchange(true))
      dMessage(0,
               "parallel SAP space: %s() finds nothing, as dParallelSAPSpaceSetEvents has not "
               "switched %s on",
               function, kind);
  }
  void ofNoContacts(const char* function) {
    if (!no_contacts_.exchange(true))
      dMessage(0,
               "parallel SAP space: %s() finds nothing, as the last collide was not "
               "dParallelSAPSpaceCollideContacts and changed no touch",
               function);
  }

 private:
  std::unique_ptr<std::unordered_set<const dxGeom*>> invalid_;
  std::atomic<bool> two_threads_{false}, events_off_{false}, no_contacts_{false};
  bool too_long_ = false, no_memory_ = false, unreported_events_ = false, unannounced_ = false;
};

}  // namespace ode_parallel_sap
