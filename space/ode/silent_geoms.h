// Geoms that ODE makes dirty without a word to their space.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "space/base/box_set.h"
#include "space/base/buffer.h"

struct dxGeom;
struct dxSpace;

namespace ode_parallel_sap {

class ParallelSAPSpace;

// dGeomTriMeshSetData makes a mesh dirty by itself, and no space hears of it. So a space checks the
// flags of its meshes and of those within sub-spaces, at any depth, and of sub-spaces if there are
// stock spaces among them. A sub-space of ours has a list of its own, which is made anew only where
// a geom came to it or left.
class SilentGeoms {
 public:
  struct Within {
    Slot slot;     // of the sub-space, in whose list nothing has changed while it is clean
    dxGeom* mesh;  // at any depth
  };

  void growTo(std::size_t slots) {
    slots_.growTo(slots);
    changed_.growTo(slots);
  }
  // A geom comes to a slot, before its constructor has set its class, which is read later.
  void add(Slot slot) { slots_.insert(slot); }
  // A geom came to the slot or left it, or the sub-space there changed. Returns whether this is
  // news: the spaces around this one are to be told, too, then.
  bool noteChange(Slot slot) {
    if (!listed_ && changed_.contains(slot)) return false;
    changed_.insert(slot);
    listed_ = false;
    return true;
  }
  // Whether check() has something to do now.
  bool remove(Slot slot) {
    if (!slots_.contains(slot)) return false;
    slots_.erase(slot);
    return true;
  }
  void renumber(const Buffer<dxGeom*>& geoms);

  // Has the sub-spaces of ours that are dirty, at any depth, bring their geoms up to date: each as
  // a call of its own, as another thread may be doing just that.
  void cleanWithin(dxGeom* const* geoms) const;
  // Has dirty() of `space`, whose geoms these are, called for each of them that was made dirty
  // silently or holds such a mesh, and makes the spaces that hold it dirty. Nothing around `space`
  // is touched where all changes were told: other threads may be there.
  void check(dxSpace& space, dxGeom* const* geoms);
  // Whether check() would find none.
  bool areClean() const { return listed_ && (!lists_ || !anyDirty()); }
  // All meshes and spaces, and geoms whose class was not read yet.
  const SlotSet& slots() const { return slots_; }
  // Lists the meshes of a space, and of spaces in it, by its geoms. Nothing while areClean().
  void listMeshes(dxGeom* const* geoms) {
    if (!areClean() && !isListed()) list(geoms);
  }
  // Adds these as those of a sub-space at a slot. Whether there are stock spaces among the spaces.
  bool addMeshes(Slot slot, std::vector<Within>& meshes) const;
  // Calls visit(space) for the sub-spaces of ours that are no small scenes, by slot, unless they
  // are more than `most`. After check().
  template <class Visit>
  void forLarge(std::size_t most, Visit visit) const {
    if (lists_ && lists_->large.size() <= most)
      for (ParallelSAPSpace* const space : lists_->large) visit(*space);
  }
  bool mayHoldSpaces() const {
    return !listed_ || slots_.count() > (lists_ ? lists_->meshes.size() : 0);
  }
  // The lists have the meshes and spaces that listing them anew finds.
  void validate(const Buffer<dxGeom*>& geoms) const;
  std::size_t bytes() const { return bytesOf(slots_, changed_, lists_); }

 private:
  // Null until there is a mesh or a space.
  struct Lists {
    bool any_stock = false;  // at any depth
    std::vector<dxGeom*> meshes, spaces;
    std::vector<Within> within;  // those of a sub-space follow each other
    std::vector<ParallelSAPSpace*> large;
    std::size_t bytes() const { return bytesOf(meshes, spaces, within, large); }
  };

  // Stock spaces that are dirty change without a word.
  bool isListed() const { return listed_ && !(lists_ && lists_->any_stock); }
  bool anyDirty() const;
  void list(dxGeom* const* geoms);
  void listWithin(dxSpace* space, Slot slot);

  SlotSet slots_;
  SlotSet changed_;            // of slots, since they were listed
  bool listed_ = true;         // slots_ is lists_
  bool within_listed_ = true;  // of the other sub-spaces
  std::unique_ptr<Lists> lists_;
};

}  // namespace ode_parallel_sap
