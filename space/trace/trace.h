// Writes what is in a space, frame by frame, to a file that others can replay: README.md of this
// room.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "space/geoms/scene.h"
#include "space/geoms/space_observer.h"
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
  void forget(const dxGeom* geom) {
    if (const auto found = geoms_.find(geom); found != geoms_.end()) found->second.has_left = true;
  }
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
    std::uint64_t frame;    // in which it was there
    bool has_left = false;  // another one may come to its address
  };
  void visit(const dxGeom* geom, std::uint32_t parent);
  std::uint32_t visit(dBodyID body);

  std::unordered_map<const dxGeom*, Seen<GeomRecord>> geoms_;
  std::unordered_map<dBodyID, Seen<BodyRecord>> bodies_;
  std::vector<std::uint32_t> gone_;  // numbers, since the last frame
  std::uint32_t last_geom_ = 0, last_body_ = 0;
  std::uint64_t frame_ = 0;
  // Of the frame that is written, as in the file.
  enum List { removed, changed_bodies, changed_geoms, poses, bounds, lists };
  TraceBytes lists_[lists];
};

// The file is made of chunks, each written whole or not at all.
class Trace final : public SpaceObserver {
 public:
  // What ODE_PARALLEL_SAP_TRACE asks for; null if nothing.
  static std::unique_ptr<Trace> fromEnvironment();
  // Every `every`-th frame. The file `later` is made with the first one. The second such file of
  // the process is `later`.2 and so on; %p in it stands for the process's number.
  explicit Trace(int every, std::string later = "") : every_(every), later_(std::move(later)) {}

  // Makes the file now, over one that is there. False with a message where that cannot be.
  bool open(const std::string& path);
  // Every how many-th frame is written; 0 once the file is closed.
  int every() const { return file_ || !later_.empty() ? every_ : 0; }

  void forget(const dxGeom* geom) override { changes_.forget(geom); }

  // Counts a frame. True: it is one to be written.
  bool wantsScene() override;
  // Writes the frame. Where that fails, dMessage says so and the trace ends.
  void seeScene(const Scene& scene, const PairRules& rules) override;
  // Writes how many pairs the frame had and the sum of their sums (trace_format::pairSum).
  bool isDue() override;
  void see(dGeomID a, dGeomID b) override;
  void endPairs() override;

 private:
  // False in the child of a fork, which would write over the files of its parent, unless the name
  // has the process's number in it.
  bool openNamed();
  // bytes_ as a chunk. Where it cannot be written, dMessage says so, and the file ends before it
  // and is closed.
  void write(const char (&tag)[9]);
  bool add(const TraceBytes& bytes);
  // Ends the trace, with this reason.
  void giveUp(const char* why);

  const int every_;
  std::string later_, path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, std::fclose};
  std::uintmax_t whole_ = 0;  // bytes, of chunks that were written
  TraceChanges changes_;
  TraceBytes head_, bytes_;
  std::uint64_t frames_ = 0;  // of the space since the trace began
  bool wants_pairs_ = false;  // of the frame that was written
  std::uint64_t pairs_ = 0, sum_ = 0;
  long process_ = 0;  // that opened the file
};

}  // namespace ode_parallel_sap
