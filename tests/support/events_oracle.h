// What a space that tells events owes: pairs that began and ended, by a map of all pairs.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "recorder.h"

namespace sap_test {

struct Event {
  dGeomID o1, o2;
  std::size_t place;
  unsigned number;
  bool operator==(const Event& other) const {
    return o1 == other.o1 && o2 == other.o2 && place == other.place && number == other.number;
  }
};
using Events = std::vector<Event>;

Events begunOf(dSpaceID space);
Events endedOf(dSpaceID space);
// Of all pairs, by place.
std::vector<unsigned> numbersOf(dSpaceID space);

// Follows a space from its first frame with events on, or from any other that it adopts.
class EventsOracle {
 public:
  using Geoms = std::map<std::size_t, dGeomID>;
  static Geoms byNumber(const std::vector<dGeomID>& geoms);

  // The frame that the space has told last had these pairs: goes on from what it says of them.
  void adopt(dSpaceID space, const Pairs& pairs);
  // `pairs`: of the next frame, in their order, by numbers that geoms have of their own for each
  // time that they were added; `geoms`: those that are in the space now. Returns what is wrong
  // about what the space says; "" if nothing is.
  std::string check(dSpaceID space, const Pairs& pairs, const Geoms& geoms);

  // Events so far.
  std::size_t begun() const { return begun_; }
  std::size_t ended() const { return ended_; }

 private:
  Events end(const Pairs& pairs, const Geoms& geoms);
  Events begin(const Pairs& pairs, const Geoms& geoms, std::vector<unsigned>& numbers);
  std::string checkSearch(dSpaceID space, const Geoms& geoms) const;

  Pairs last_;
  std::map<Pair, unsigned> numbers_;
  std::set<unsigned> free_;  // below next_
  unsigned next_ = 0;
  std::vector<unsigned> ended_numbers_;
  std::size_t most_ = 0, begun_ = 0, ended_ = 0;
};

}  // namespace sap_test
