// The pairs that are to be collided: the list behind the `pairs` of dParallelSAPAddPair.
#pragma once

#include <exception>
#include <optional>

#include "space/base/pair_list.h"
#include "space/base/parallel.h"
#include "space/contacts/narrow_phase.h"
#include "space/geoms/scene.h"

namespace ode_parallel_sap {

class ContactPairs {
 public:
  // They are put into `list`, and `slots` gets those from which they come. `firsts`, if any, gets
  // the place of the first one that each pair of the scene is or brings.
  ContactPairs(const ContactRequest& request, const Scene& scene, Buffer<dParallelSAPPair>& list,
               Buffer<Pair>& slots, Buffer<std::size_t>* firsts)
      : request_(request), scene_(scene), list_(list), slots_(slots), firsts_(firsts) {
    list_.resizeDiscarding(0);
    slots_.resizeDiscarding(0);
    if (firsts_) firsts_->resizeDiscarding(0);
  }

  // Adds a pair, or in the place of one with a space what the request wants collided then.
  // Where there is no memory for it, the pairs so far are collided and reported at once. What a
  // callback throws then is thrown again when dSpaceCollide2, which would leave a stock space
  // locked, is over.
  void add(dGeomID o1, dGeomID o2);
  // Makes the pairs of the scene the whole list. Unless `spaces`, none of its geoms is one.
  void add(const PairList& pairs, bool spaces, int threads);

  const Buffer<dParallelSAPPair>& list() const { return list_; }
  // Whether none was reported already, and no first that was asked for is missing.
  bool isComplete() const { return is_complete_; }
  // Whether the list is the pairs of the scene; if not, firsts() has the places of these.
  bool isOfScene() const { return cursor_.has_value(); }
  const Buffer<std::size_t>& firsts() const { return *firsts_; }
  bool knowsPlaces() const { return firsts_ || isOfScene(); }
  const Scene& scene() const { return scene_; }
  // Whether both geoms of the pair at a place, no less than in any call before, are still there.
  bool stays(std::size_t place);

 private:
  void addSpace(dGeomID o1, dGeomID o2);
  Slot slotOf(const dxGeom* geom) const;
  bool stays(const dParallelSAPPair& pair, Pair slots) const;

  const ContactRequest& request_;
  const Scene& scene_;
  Buffer<dParallelSAPPair>& list_;
  Buffer<Pair>& slots_;
  Buffer<std::size_t>* const firsts_;
  std::optional<PairCursor> cursor_;  // in the pairs of the scene, if they are the list
  Pair top_ = 0;                      // the pair of the scene that is added
  bool is_complete_ = true;
  int depth_ = 0;  // of pairs with spaces that are gone through
  std::exception_ptr failure_;
};

// Writes the pairs of geoms behind pairs of slots to `to`; returns what comes after them.
dParallelSAPPair* resolve(const Pair* begin, const Pair* end, dxGeom* const* geoms,
                          dParallelSAPPair* to);

// The same of the pairs at places [begin, end) of a list, by up to `threads` threads.
void resolve(const PairList& pairs, Range places, dxGeom* const* geoms, int threads,
             dParallelSAPPair* to);

}  // namespace ode_parallel_sap
