// The pairs that are to be collided: the list behind the `pairs` of dParallelSAPAddPair.
#pragma once

#include <exception>

#include "space/base/pair_list.h"
#include "space/contacts/narrow_phase.h"

namespace ode_parallel_sap {

class ContactPairs {
 public:
  // They are put into `list`.
  ContactPairs(const ContactRequest& request, Buffer<dParallelSAPPair>& list)
      : request_(request), list_(list) {
    list_.resizeDiscarding(0);
  }

  // Adds a pair, or in the place of one with a space what the request wants collided then.
  // Where there is no memory for it, the pairs so far are collided and reported at once. What a
  // callback throws then is thrown again when dSpaceCollide2, which would leave a stock space
  // locked, is over.
  void add(dGeomID o1, dGeomID o2);
  // Makes the pairs of a space whose geoms these are, by slot, the whole list. Unless `spaces`,
  // none of the geoms is one.
  void add(const PairList& pairs, dxGeom* const* geoms, bool spaces, int threads);

  const Buffer<dParallelSAPPair>& list() const { return list_; }

 private:
  void addSpace(dGeomID o1, dGeomID o2);

  const ContactRequest& request_;
  Buffer<dParallelSAPPair>& list_;
  int depth_ = 0;  // of pairs with spaces that are gone through
  std::exception_ptr failure_;
};

// Writes the pairs of geoms behind pairs of slots to `to`; returns what comes after them.
dParallelSAPPair* resolve(const Pair* begin, const Pair* end, dxGeom* const* geoms,
                          dParallelSAPPair* to);

// Makes `all` the pairs of a space whose geoms these are, by slot.
void listPairs(const PairList& pairs, dxGeom* const* geoms, int threads,
               Buffer<dParallelSAPPair>& all);

}  // namespace ode_parallel_sap
