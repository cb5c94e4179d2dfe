// The update stage: geoms in, boxes out. Sees ODE's private headers.
#ifndef ODE_PARALLEL_SAP_GEOM_UPDATE_H
#define ODE_PARALLEL_SAP_GEOM_UPDATE_H

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "box_set.h"
#include "buffer.h"

struct dxBody;
struct dxGeom;

namespace ode_parallel_sap {

// What the later stages must know of the geoms behind the boxes.
struct UpdateFacts {
  std::size_t moved = 0;
  std::size_t disabled = 0;
  std::size_t unbounded = 0;
  std::size_t coarse = 0;     // boxes that floats make clearly larger
  bool user_classes = false;  // AABBTest may decide
  bool spaces = false;        // some geom is a space
  bool exact_bits = true;     // the 32 filter bits of all boxes decide as ODE's 64 would
  bool exact_bodies = true;   // 32 bits of the bodies' addresses tell them apart
  bool exact_boxes = true;    // no float bound was rounded
  bool filter_bits = false;
  bool filter_bodies = false;
  std::vector<Slot> invalid;  // slots of NaN bounds, ascending

  void add(const UpdateFacts& other);
};

// The paper's first half: each thread brings the AABBs of its n/c geoms up to date and writes their
// boxes to a part of the storage that is its own; joining the parts then moves no box.
class GeomUpdate {
 public:
  // Brings every dirty geom of geoms[0..slots) up to date (null: an empty slot).
  void clean(dxGeom* const* geoms, std::size_t slots, int threads);
  // The same, and fills `boxes`, with doubles where floats would be too coarse for the scene.
  // Returns the number of threads used.
  int pack(dxGeom* const* geoms, std::size_t slots, int threads, BoxSet& boxes);
  // The threads' facts made one. Call after pack().
  const UpdateFacts& synchronise(dxGeom* const* geoms, BoxSet& boxes);

 private:
  struct alignas(64) Part {
    UpdateFacts facts;
    std::vector<Slot> deferred;  // moved geoms that only one thread may touch
    std::uintptr_t some_body = 0;
  };

  int run(dxGeom* const* geoms, std::size_t slots, int threads, BoxSet* boxes);
  void mergeFacts();
  void numberBodies(dxGeom* const* geoms, BoxSet& boxes);

  std::vector<Part> parts_;
  int part_count_ = 0;
  UpdateFacts facts_;
  std::unordered_map<const dxBody*, std::uint32_t> body_numbers_;
};

}  // namespace ode_parallel_sap

#endif
