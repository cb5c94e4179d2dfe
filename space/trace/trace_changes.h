// What changed in a space since the last frame of its trace. Sees ODE's private headers.
#pragma once

#include <cstdint>
#include <cstring>
#include <unordered_map>
#include <vector>

#include "space/geoms/scene.h"
#include "space/geoms/slots.h"
#include "space/trace/trace_file.h"
#include "space/trace/trace_format.h"

namespace ode_parallel_sap {

// Records have no gaps, so that their bytes can be compared: a NaN is what it is.
template <class Record>
bool same(const Record& a, const Record& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

struct GeomRecord {
  // What seldom changes.
  struct Traits {
    std::uint32_t number, parent, geom_class, flags, body, none;
    std::uint64_t category_bits, collide_bits;
    dReal params[trace_format::params];
  } traits;
  dReal pose[trace_format::pose];
  dReal bounds[trace_format::bounds];

  void put(TraceBytes& bytes) const;
};

struct BodyRecord {
  std::uint32_t number, flags;
  dReal pose[trace_format::pose];

  void put(TraceBytes& bytes) const;
};

// Geoms get numbers from 1 on when they are first written. Those of the space keep theirs until
// they leave it, so numbers ascend in the order of the report; those of spaces within it are known
// by their address.
class TraceChanges {
 public:
  // Which geom is in which slot. These take no memory.
  void forget(Slot slot) {
    if (slot < slots_.size()) slots_[slot].traits.number = 0;
  }
  void closeSlots(const Buffer<dxGeom*>& geoms);

  // Compares all geoms, which are up to date, with what was written, and writes what is else.
  void write(const Scene& scene, TraceBytes& bytes);

  // Of a geom of the space that was written; 0 of any other.
  std::uint32_t numberIn(Slot slot) const {
    return slot < slots_.size() ? slots_[slot].traits.number : 0;
  }

 private:
  template <class Record>
  struct Seen {
    Record record;
    std::uint64_t frame;  // in which it was there
  };
  struct List {
    std::uint32_t count = 0;
    TraceBytes bytes;
    void clear() {
      count = 0;
      bytes.clear();
    }
  };

  void visit(const dxGeom* geom, std::uint32_t parent, GeomRecord& last);
  void visitInner(const dxSpace* space, std::uint32_t number);
  std::uint32_t numberOf(dBodyID body);
  void compare(const GeomRecord& now, GeomRecord& last);
  void findRemoved();
  void dropUnseen();

  std::vector<GeomRecord> slots_;
  std::unordered_map<const dxGeom*, Seen<GeomRecord>> inner_;
  std::unordered_map<dBodyID, Seen<BodyRecord>> bodies_;
  std::vector<std::uint32_t> present_, present_before_;
  std::uint32_t last_geom_ = 0, last_body_ = 0;
  std::uint64_t frame_ = 0;
  List removed_, body_list_, geom_list_, poses_, bounds_;
};

}  // namespace ode_parallel_sap
