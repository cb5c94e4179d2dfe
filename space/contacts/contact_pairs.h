// The pairs that are to be collided: the list behind the `pairs` of dParallelSAPAddPair.
#ifndef ODE_PARALLEL_SAP_CONTACT_PAIRS_H
#define ODE_PARALLEL_SAP_CONTACT_PAIRS_H

#include "space/contacts/narrow_phase.h"
#include "space/data/pair_list.h"

namespace ode_parallel_sap {

class ContactPairs {
 public:
  // Takes over the storage of a list, to give it back by release().
  ContactPairs(const ContactRequest& request, Buffer<GeomPair>&& storage);

  // Adds a pair, or in the place of one with a space what the request says is to be collided then.
  // Where there is no memory for it, the pairs so far are collided and reported at once.
  void add(dGeomID o1, dGeomID o2);
  // Makes the pairs of a space whose geoms these are, by slot, the whole list. Unless `spaces`,
  // none of the geoms is one.
  void add(const PairList& pairs, dxGeom* const* geoms, bool spaces, int threads);

  const Buffer<GeomPair>& list() const { return list_; }
  Buffer<GeomPair>&& release() { return std::move(list_); }

 private:
  bool makeRoom(std::size_t pairs);
  void collideNow();

  const ContactRequest& request_;
  Buffer<GeomPair> list_;
};

// Makes `all` the pairs of a space whose geoms these are, by slot.
void listPairs(const PairList& pairs, dxGeom* const* geoms, int threads, Buffer<GeomPair>& all);

}  // namespace ode_parallel_sap

#endif
