// The update stage: geoms in, boxes out.
#pragma once

#include <cstddef>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/base/parallel.h"
#include "space/geoms/geom_packer.h"

namespace ode_parallel_sap {

// Boxes that floats make clearly larger overlap others that their geoms do not, if they are close
// together. Bodies that have fallen out of a scene, and the small ones of a scene of all sizes, are
// coarse, too, but lie far apart.
class CoarseBoxes {
 public:
  // Whether more than about `most` pairs of the `coarse` boxes overlap in floats alone, by a sample
  // of them. If so, they count as doing so for some frames. Needs clean geoms.
  bool overlapFalsely(dxGeom* const* geoms, const Buffer<SlotState>& states, std::size_t coarse,
                      std::size_t most);
  // Whether there are so many more of them since that the answer may be another.
  bool areManyMore(std::size_t coarse) const { return coarse > 2 * sampled_of_ + most_sampled; }
  std::size_t bytes() const { return bytesOf(sample_); }

 private:
  static constexpr std::size_t most_sampled = 512;
  struct Sampled {
    Box box;
    const dxGeom* geom;
  };
  void take(dxGeom* const* geoms, const Buffer<SlotState>& states, std::size_t coarse);

  std::vector<Sampled> sample_;
  int axis_ = 0;                // by which it is sorted
  std::size_t sampled_of_ = 0;  // coarse boxes
  bool answer_ = false;
  int age_ = 0;  // of the answer, in frames
};

// The paper's first half: threads take parts of the geoms, bring their AABBs up to date and write
// their boxes to the same parts of the storage. So nobody moves a box to join the parts.
class GeomUpdate {
 public:
  // Brings the dirty ones of geoms[0..slots) up to date (null: an empty slot). All of them are in
  // `changed`, if that is not null.
  void clean(dxGeom* const* geoms, std::size_t slots, int threads, const SlotSet* changed);

  // Brings all up to date and fills boxes(): with doubles if floats are too coarse for the scene.
  // Sets which filters the boxes need. A reader, if any, gets the floats of a large scene while
  // others are packed. Returns the number of threads used.
  int pack(dxGeom* const* geoms, std::size_t slots, const PairRules& rules, int threads,
           BoxReader* reader = nullptr);

  // Whether repack() may follow what was packed last.
  bool canRepack() const { return facts_.exact_bits || boxes_.wide_bits.data(); }
  // Adds to `changed` the slots of silent changes: of bits, bodies, enabled states. Reads the geoms
  // whose silent changes matter by the rules, or `all`. Returns the number of threads used.
  int addSilent(dxGeom* const* geoms, std::size_t slots, int threads, bool all, SlotSet& changed);
  // The silent changes apart from `changed`, although the rules promise to announce all.
  struct Unannounced {
    std::size_t count = 0;
    Slot first = 0;
  };
  Unannounced findUnannounced(dxGeom* const* geoms, const SlotSet& changed) const;
  // pack() by the same rules for the slots of `changed` alone, which contain all whose geoms are
  // others now. False if boxes() has to be packed as a whole, because the facts are others now.
  bool repack(dxGeom* const* geoms, std::size_t slots, int threads, const SlotSet& changed);
  // The slots of the last repack(), ascending.
  const Buffer<Slot>& repacked() const { return slots_; }
  const UpdateFacts& facts() const { return facts_; }
  // The tolerance that boxes() allow: none while a box lies too far out for it.
  dReal tolerance() const { return facts_.beyond_tolerance ? 0 : packer_.rules.tolerance; }
  const SlotState* states() const { return states_.data(); }  // by slot
  const BoxSet& boxes() const { return boxes_; }
  // Boxes, filters and states are those of their geoms, and the facts count the states.
  void validate(dxGeom* const* geoms) const;
  std::size_t bytes() const {
    return bytesOf(boxes_, parts_, states_, watched_, slots_, coarse_boxes_);
  }

 private:
  template <class SlotAt, class Use>
  int forGeoms(dxGeom* const* geoms, std::size_t count, SlotAt slotAt, int threads, Use use);
  template <class SlotAt, class Use>
  static void forPart(dxGeom* const* geoms, std::size_t count, SlotAt slotAt, Range range, Use use,
                      UpdatePart& part);
  void addParts();
  void watchAll();

  BoxSet boxes_;
  std::vector<UpdatePart> parts_;
  UpdateFacts facts_;
  GeomPacker packer_;
  Buffer<SlotState> states_;  // by slot
  SlotSet watched_;           // slots that addSilent() reads
  bool watching_ = false;
  Buffer<Slot> slots_;  // those of a repack
  CoarseBoxes coarse_boxes_;
};

}  // namespace ode_parallel_sap
