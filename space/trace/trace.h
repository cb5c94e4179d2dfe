// Writes what is in a space, frame by frame, to a file that others can replay: README.md of this
// room.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "space/geoms/space_observer.h"
#include "space/trace/trace_changes.h"

namespace ode_parallel_sap {

// A file of chunks, each written whole or not at all.
class TraceFile {
 public:
  // Makes the file, over one that is there. False with a message where that cannot be.
  bool open(const std::string& path);
  bool isOpen() const { return file_ != nullptr; }
  // A chunk. Where it cannot be written, dMessage says so, and the file ends before it and is
  // closed.
  void write(const char (&tag)[9], TraceBytes& contents);
  // Ends the trace, with this reason.
  void giveUp(const char* why);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  bool add(const TraceBytes& bytes);

  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
  std::uintmax_t whole_ = 0;  // bytes, of chunks that were written
  TraceBytes head_;
};

class Trace final : public SpaceObserver {
 public:
  // What ODE_PARALLEL_SAP_TRACE asks for; null if nothing.
  static std::unique_ptr<Trace> fromEnvironment();
  // Every `every`-th frame. The file `later` is made with the first one. The second such file of
  // the process is `later`.2 and so on; %p in it stands for the process's number.
  explicit Trace(int every, std::string later = "") : every_(every), later_(std::move(later)) {}

  // Makes the file now. False with a message where that cannot be.
  bool open(const std::string& path);
  // Every how many-th frame is written; 0 once the file is closed.
  int every() const { return file_.isOpen() || !later_.empty() ? every_ : 0; }

  void forget(const dxGeom* geom) override { changes_.forget(geom); }

  // Counts a frame. True: it is one to be written.
  bool wantsScene() override;
  // Writes the frame. Where that fails, dMessage says so and the trace ends.
  void seeScene(const Scene& scene, const PackRules& rules) override;
  // Writes how many pairs the frame had and the sum of their sums (trace_format::pairSum).
  bool isDue() override;
  void see(dGeomID a, dGeomID b) override;
  void endPairs() override;

 private:
  // False in the child of a fork, which would write over the files of its parent, unless the name
  // has the process's number in it.
  bool openNamed();

  const int every_;
  std::string later_;
  TraceFile file_;
  TraceChanges changes_;
  TraceBytes bytes_;
  std::uint64_t frames_ = 0;  // of the space since the trace began
  bool wants_pairs_ = false;  // of the frame that was written
  std::uint64_t pairs_ = 0, sum_ = 0;
  long process_ = 0;  // that opened the file
};

}  // namespace ode_parallel_sap
