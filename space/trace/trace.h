// Writes what is in a space, frame by frame, to a file that others can replay: README.md of this
// room. Sees ODE's private headers.
#pragma once

#include <cstdint>
#include <string>

#include "space/geom/pack_rules.h"
#include "space/geom/scene.h"
#include "space/trace/trace_changes.h"
#include "space/trace/trace_file.h"

namespace ode_parallel_sap {

class Trace {
 public:
  // Every `every`-th frame.
  explicit Trace(int every) : every_(every) {}

  // Makes the file now. False with a message where that cannot be.
  bool open(const std::string& path);
  // Makes it with the first frame. The second such file of the process is `path`.2 and so on; %p in
  // it stands for the process's number.
  void openLater(const std::string& path) { later_ = path; }
  // Every how many-th frame is written; 0 once the file is closed.
  int every() const { return file_.isOpen() || !later_.empty() ? every_ : 0; }

  // A geom comes to a slot, or leaves it. `geoms`: before their slots are closed up.
  void forget(Slot slot) { changes_.forget(slot); }
  void closeSlots(const Buffer<dxGeom*>& geoms) { changes_.closeSlots(geoms); }

  // Counts a frame. True: it is one to be written.
  bool noteFrame();
  // Writes the frame; all geoms are up to date. Where that fails, dMessage says so and the trace
  // ends.
  void write(const Scene& scene, const PackRules& rules);
  // How many pairs the frame had and the sum of their sums (trace_format::pairSum).
  void writePairs(std::uint64_t pairs, std::uint64_t sum);
  std::uint32_t numberOf(const dxGeom* geom) const {
    return changes_.numberIn(Slots::slotOf(geom));
  }

 private:
  // False in the child of a fork, which would write over the files of its parent, unless the name
  // has the process's number in it.
  bool openNamed();
  std::string nameOfNext() const;

  const int every_;
  std::string later_;
  TraceFile file_;
  TraceChanges changes_;
  TraceBytes bytes_;
  std::uint64_t frames_ = 0;  // of the space since the trace began
  long process_ = 0;          // that opened the file
};

}  // namespace ode_parallel_sap
