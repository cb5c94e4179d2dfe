// Makes the geoms of a trace again, frame by frame, in a space of any kind.
#pragma once

#include <ode/ode.h>

#include <cstdint>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "trace_reader.h"

namespace trace {

// A trace in memory.
struct Recording {
  std::string name;
  Header header;
  std::vector<Frame> frames;
  // Geoms that are made with the bounding boxes that were written instead of a shape: their classes
  // cannot be made again, or ODE computes another bounding box here than there.
  std::set<std::uint32_t> by_bounds;
};

// Throw BadTrace: also where the file is whole but makes no sense. From then on the environment
// asks for no traces.
Recording readRecording(const std::string& path);
Recording readRecording(std::istream& file, const std::string& name);

// The scene of one frame after the other. The space is the caller's, and empty; the player's end
// empties it.
class Player {
 public:
  Player(const Recording& recording, dSpaceID space);
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  // Goes on to the next frame, after the last one to the first, with all geoms made anew. Throws
  // BadTrace.
  const Frame& advance();
  // The frame that is shown.
  const Frame& frame() const { return recording_.frames[shown_]; }
  std::size_t place() const { return shown_; }

  // Of a geom that the player made.
  static std::uint32_t numberOf(dGeomID geom) {
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(dGeomGetData(geom)));
  }
  // Those, spaces apart, that are shown with other bounding boxes than were written.
  std::vector<std::uint32_t> otherBounds() const;

 private:
  struct Part {
    Geom record = {};
    dGeomID geom = nullptr;
    int kind = 0;  // what `geom` is made as
    dSpaceID in = nullptr;
  };

  void clear();
  void show(const Frame& frame);
  void showBody(const Body& body);
  void showGeom(const Geom& record);
  void remove(std::uint32_t number);
  void emptySpace(dSpaceID space);
  int kindOf(const Geom& record) const;
  void putIntoSpace(Part& part);
  void putOnBody(const Part& part);
  void place(const Part& part);
  Part& partOf(std::uint32_t number);
  [[noreturn]] void fail(const std::string& what) const;

  const Recording& recording_;
  const dSpaceID space_;
  dWorldID world_;
  std::unordered_map<std::uint32_t, Part> parts_;
  std::unordered_map<std::uint32_t, dBodyID> bodies_;
  std::size_t shown_;  // as many as there are frames: none
};

// What the program had set in this frame.
void setAsTraced(dSpaceID space, const Frame& frame);
// The pairs of a space of a player's geoms.
PairTotals collide(dSpaceID space);

}  // namespace trace
