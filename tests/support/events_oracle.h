// What a space that tells events owes: pairs and touches that began and ended, by a map of all.
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

Events eventsOf(dSpaceID space, std::size_t (*get)(dSpaceID, const dParallelSAPPairEvent**));
inline Events begunOf(dSpaceID space) {
  return eventsOf(space, dParallelSAPSpaceGetBegunPairs);
}
inline Events endedOf(dSpaceID space) {
  return eventsOf(space, dParallelSAPSpaceGetEndedPairs);
}
inline Events begunTouchesOf(dSpaceID space) {
  return eventsOf(space, dParallelSAPSpaceGetBegunTouches);
}
inline Events endedTouchesOf(dSpaceID space) {
  return eventsOf(space, dParallelSAPSpaceGetEndedTouches);
}
// Of all pairs, by place.
std::vector<unsigned> numbersOf(dSpaceID space);

// What a space has told of its pairs or touches: those that last, by their numbers.
class Followed {
 public:
  // "" or which event cannot be, after those before.
  std::string follow(const Events& begun, const Events& ended);
  Pairs lasting() const;

 private:
  std::map<unsigned, Pair> lasting_;
};

// Follows a space from its first frame with events on.
class EventsOracle {
 public:
  using Geoms = std::map<std::size_t, dGeomID>;
  static Geoms byNumber(const std::vector<dGeomID>& geoms);

  // `pairs`: of the next frame, in their order, by numbers that geoms have of their own for each
  // time that they were added; `geoms`: those that are in the space now. Returns what is wrong
  // about what the space says; "" if nothing is.
  std::string check(dSpaceID space, const Pairs& pairs, const Geoms& geoms);
  // `touches`: the two geoms whose contacts are reported, in that order, of a frame whose pairs
  // were checked. `within`: all geoms in sub-spaces.
  std::string checkTouches(dSpaceID space, const Pairs& touches, const Geoms& geoms,
                           const Geoms& within);

 private:
  struct Known {
    unsigned number;
    std::size_t place;
    bool within;  // a touch in sub-spaces
  };

  Events end(dSpaceID space, const Pairs& pairs, const Geoms& geoms);
  Events begin(const Pairs& pairs, const Geoms& geoms, std::vector<unsigned>& numbers);
  std::string checkSearch(dSpaceID space, const Geoms& geoms) const;
  using Names = std::map<dGeomID, std::size_t>;
  std::size_t placeOf(dSpaceID space, dGeomID a, dGeomID b, const Names& names) const;
  std::string beginTouches(dSpaceID space, const Pairs& touches, const Geoms& geoms,
                           const Names& names);
  std::string endTouches(dSpaceID space, const std::set<Pair>& now, const Geoms& geoms,
                         const Geoms& all);
  unsigned takeNumber();

  Pairs last_;
  std::map<Pair, Known> known_;  // reported or at rest
  std::set<unsigned> free_;      // below next_
  std::set<unsigned> held_;      // of touches whose pairs have ended
  unsigned next_ = 0;
  std::vector<unsigned> ended_numbers_;
  std::size_t most_ = 0;
  std::map<Pair, Known> touches_;
};

}  // namespace sap_test
