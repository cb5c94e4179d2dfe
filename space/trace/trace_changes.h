// What changed in a space since the last frame of its trace.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "space/geoms/scene.h"
#include "space/trace/trace_format.h"

namespace ode_parallel_sap {

// The contents of a chunk.
using TraceBytes = std::string;
// Appends numbers, or records of numbers without gaps.
template <class... Values>
void put(TraceBytes& bytes, const Values&... values) {
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
}
// Appends zeros up to a multiple of eight bytes.
inline void pad(TraceBytes& bytes) {
  bytes.resize((bytes.size() + 7) / 8 * 8);
}

// As in the file. Records have no gaps, so that their bytes can be compared: a NaN is what it is.
struct GeomRecord {
  // What seldom changes.
  struct Traits {
    std::uint32_t number, parent, geom_class, flags, body, none;
    std::uint64_t category_bits, collide_bits;
    dReal params[trace_format::params];
  } traits;
  dReal pose[trace_format::pose];
  dReal bounds[trace_format::bounds];
};

struct BodyRecord {
  std::uint32_t number, flags;
  dReal pose[trace_format::pose];
};
static_assert(sizeof(GeomRecord) == 40 + 22 * sizeof(dReal), "no gaps");
static_assert(sizeof(BodyRecord) == 8 + 12 * sizeof(dReal), "no gaps");

// Geoms get numbers from 1 on when they are first written, and are known by their address. Those of
// the space keep theirs until they leave it, so numbers ascend in the order of the report.
class TraceChanges {
 public:
  // A geom leaves the space. Takes no memory.
  void forget(const dxGeom* geom) { geoms_.erase(geom); }
  // Compares all geoms, which are up to date, with what was written, and writes what is else.
  void write(const Scene& scene, TraceBytes& bytes);
  // Of a geom that was written; 0 of any other.
  std::uint32_t numberOf(const dxGeom* geom) const {
    const auto found = geoms_.find(geom);
    return found == geoms_.end() ? 0 : found->second.record.traits.number;
  }

 private:
  template <class Record>
  struct Seen {
    Record record;
    std::uint64_t frame;  // in which it was there
  };
  void visit(const dxGeom* geom, std::uint32_t parent);
  std::uint32_t visit(dBodyID body);
  void compare(const GeomRecord& now, GeomRecord& last);
  void dropUnseen();

  std::unordered_map<const dxGeom*, Seen<GeomRecord>> geoms_;
  std::unordered_map<dBodyID, Seen<BodyRecord>> bodies_;
  std::vector<std::uint32_t> present_, present_before_;
  std::uint32_t last_geom_ = 0, last_body_ = 0;
  std::uint64_t frame_ = 0;
  // Of the frame that is written, as in the file.
  enum List { removed, changed_bodies, changed_geoms, poses, bounds, lists };
  TraceBytes lists_[lists];
};

}  // namespace ode_parallel_sap
