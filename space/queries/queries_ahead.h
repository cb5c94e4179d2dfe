// Queries that are likely to come, found together by a team. Sees ODE's private headers.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/data/back_off.h"
#include "space/data/buffer.h"
#include "space/data/parallel.h"
#include "space/queries/found_slots.h"
#include "space/queries/geom_tree.h"

namespace ode_parallel_sap {

// dSpaceCollide2 of two spaces goes through the list of the one and asks the other about each geom.
// Who is asked about geoms of a list in their order therefore finds what the next ones overlap
// beforehand, on many threads.
//
// What is found is an answer as long as no geom of the space asked has changed, which drop() says,
// and is given for the very AABB that it was found for. It names all whose AABBs overlap: bits,
// bodies and enabled states are looked at when it is given. Where answers are not asked for,
// because geoms of either space change between the queries, or the list is left, fewer are found
// ahead, at longer and longer intervals.
class QueriesAhead {
 public:
  using Geoms = GeomTree::Geoms;
  struct Answer {
    dxGeom* const* begin;
    dxGeom* const* end;
  };

  // A geom of the space asked changed.
  void drop() {
    if (next_ < items_.size()) giveUp();
  }
  // Takes notice of a query, for a geom whose AABB is up to date. Whether find() should be called.
  bool isDue(const dxGeom* geom);
  struct Found {
    std::size_t queries = 0;
    int threads = 1;  // that were used
  };
  // Finds the answers for this geom and those behind it in its list; calls nothing of the user's.
  // The tree is up to date. Throws std::bad_alloc.
  Found find(const Geoms& geoms, const GeomTree& tree, dxGeom* geom, int threads);
  // For a query that was noticed: what was found, in ascending order of the slots, or false. Valid
  // until the next call.
  bool take(const dxGeom* geom, Answer& answer);

  // Gives back all that is held.
  void release();
  std::size_t bytes() const { return bytesOf(items_, shares_); }

 private:
  struct Item {
    dxGeom* geom;
    dReal bounds[6];
    bool comes, known;  // not where it has a NaN bound; not where others overlap too many
    std::uint32_t share;
    std::size_t begin, end;  // in the share's list
  };
  // What a thread found.
  struct Share {
    FoundSlots slots;
    Buffer<dxGeom*> geoms;
    std::size_t bytes() const { return bytesOf(slots, geoms); }
  };

  // fixed: a program that asks about so many geoms of a list in their order goes on with it.
  static constexpr std::size_t least_run = 16;
  // fixed: 1.5 MB of them. Items that are found together, at most.
  static constexpr std::size_t most_ahead = std::size_t{1} << 14;

  bool holds(const dxGeom* geom) const;
  void giveUp();
  void skipOthers();
  void gather(dxGeom* geom);
  void findSome(const Geoms& geoms, const GeomTree& tree, const Range& range, std::uint32_t number);
  void prefetch(std::size_t index) const;

  const dxGeom* expected_ = nullptr;  // the next one in the list, if it is gone through
  std::size_t run_ = 0;               // queries of one list in its order
  std::size_t most_ = least_run;      // items that are found next, at most
  BackOff back_off_{static_cast<int>(least_run)};
  double mean_found_ = 0;  // of an item
  std::size_t next_ = 0;   // item that is asked for next
  Buffer<Item> items_;
  std::vector<Share> shares_;
};

}  // namespace ode_parallel_sap
