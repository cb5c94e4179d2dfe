#include "events_oracle.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "rules_oracle.h"

namespace sap_test {
namespace {

Events eventsOf(std::size_t (*get)(dSpaceID, const dParallelSAPPairEvent**), dSpaceID space) {
  const dParallelSAPPairEvent* pairs = nullptr;
  const std::size_t count = get(space, &pairs);
  if ((count == 0) != (pairs == nullptr)) throw std::logic_error("a list and its length differ");
  Events events;
  for (std::size_t i = 0; i < count; ++i)
    events.push_back({pairs[i].o1, pairs[i].o2, pairs[i].place, pairs[i].number});
  return events;
}

dGeomID geomOf(const EventsOracle::Geoms& geoms, std::size_t number) {
  const auto found = geoms.find(number);
  return found == geoms.end() ? nullptr : found->second;
}

Pair ascending(std::size_t a, std::size_t b) {
  return {std::min(a, b), std::max(a, b)};
}

// By place, equal ones in the order of the pairs.
void sortByPlace(Events& events) {
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.place < b.place; });
}

Rest restOf(dSpaceID space, const EventsOracle::Geoms& geoms, const Pair& pair) {
  const dGeomID a = geomOf(geoms, pair.first), b = geomOf(geoms, pair.second);
  return a && b ? restOf(Rules::of(space), a, b) : Rest::no;
}

// Whether a geom of a touch is in a sub-space.
bool isWithin(const Pair& touch, const EventsOracle::Geoms& geoms) {
  return !geoms.count(touch.first) || !geoms.count(touch.second);
}

// The geom of the space that a geom is, or is in.
dGeomID topOf(dSpaceID space, dGeomID geom) {
  while (dGeomGetSpace(geom) != space) geom = asGeom(dGeomGetSpace(geom));
  return geom;
}

}  // namespace

Events begunOf(dSpaceID space) {
  return eventsOf(dParallelSAPSpaceGetBegunPairs, space);
}

Events endedOf(dSpaceID space) {
  return eventsOf(dParallelSAPSpaceGetEndedPairs, space);
}

Events begunTouchesOf(dSpaceID space) {
  return eventsOf(dParallelSAPSpaceGetBegunTouches, space);
}

Events endedTouchesOf(dSpaceID space) {
  return eventsOf(dParallelSAPSpaceGetEndedTouches, space);
}

std::vector<unsigned> numbersOf(dSpaceID space) {
  const unsigned* numbers = nullptr;
  const std::size_t count = dParallelSAPSpaceGetPairNumbers(space, &numbers);
  return std::vector<unsigned>(numbers, numbers + count);
}

EventsOracle::Geoms EventsOracle::byNumber(const std::vector<dGeomID>& geoms) {
  Geoms by_number;
  for (const dGeomID geom : geoms) by_number[number(geom)] = geom;
  return by_number;
}

Events EventsOracle::end(dSpaceID space, const Pairs& pairs, const Geoms& geoms) {
  const std::set<Pair> now(pairs.begin(), pairs.end());
  const Events told = endedOf(space);
  Events ended;
  for (auto known = known_.begin(); known != known_.end();) {
    const auto& [pair, is] = *known;
    const Event event = {geomOf(geoms, pair.first), geomOf(geoms, pair.second), is.place,
                         is.number};
    const Rest rest = now.count(pair) ? Rest::yes : restOf(space, geoms, pair);
    if (rest == Rest::yes ||
        (rest == Rest::either && std::find(told.begin(), told.end(), event) == told.end())) {
      ++known;
      continue;
    }
    ended.push_back(event);
    ended_numbers_.push_back(is.number);
    known = known_.erase(known);
  }
  sortByPlace(ended);
  return ended;
}

unsigned EventsOracle::takeNumber() {
  if (free_.empty()) free_.insert(next_++);
  const unsigned free = *free_.begin();
  free_.erase(free_.begin());
  return free;
}

Events EventsOracle::begin(const Pairs& pairs, const Geoms& geoms, std::vector<unsigned>& numbers) {
  Events begun;
  for (std::size_t place = 0; place < pairs.size(); ++place) {
    const Pair& pair = pairs[place];
    const auto known = known_.find(pair);
    if (known == known_.end()) {
      const unsigned free = takeNumber();
      known_[pair] = {free, place, false};
      begun.push_back({geomOf(geoms, pair.first), geomOf(geoms, pair.second), place, free});
    }
    known_[pair].place = place;
    numbers.push_back(known_[pair].number);
  }
  return begun;
}

std::string EventsOracle::check(dSpaceID space, const Pairs& pairs, const Geoms& geoms) {
  // What ended in the frame before is free from now on, unless its touch lasts.
  for (const unsigned number : ended_numbers_) {
    const bool is_held = std::any_of(touches_.begin(), touches_.end(), [&](const auto& touch) {
      return !touch.second.within && touch.second.number == number;
    });
    (is_held ? held_ : free_).insert(number);
  }
  ended_numbers_.clear();
  const Events ended = end(space, pairs, geoms);
  std::vector<unsigned> numbers;
  const Events begun = begin(pairs, geoms, numbers);
  most_ = std::max(most_, known_.size() + ended.size());
  last_ = pairs;
  begun_ += begun.size();
  ended_ += ended.size();
  if (begunOf(space) != begun) return "begun pairs differ";
  if (endedOf(space) != ended) return "ended pairs differ";
  if (numbersOf(space) != numbers) return "numbers differ";
  for (const unsigned number : numbers)
    if (!(dParallelSAPSpaceGetEvents(space) & dParallelSAPEventTouches) && number >= most_)
      return "a number is larger than it may be";
  return checkSearch(space, geoms);
}

std::string EventsOracle::checkSearch(dSpaceID space, const Geoms& geoms) const {
  unsigned number = 0;
  for (std::size_t i = 0; i < last_.size(); i += 1 + last_.size() / 50) {
    const dGeomID a = geoms.at(last_[i].first), b = geoms.at(last_[i].second);
    const bool turned = i % 2;
    if (!dParallelSAPSpaceFindPair(space, turned ? b : a, turned ? a : b, &number) ||
        number != known_.at(last_[i]).number)
      return "a pair is not found";
  }
  if (geoms.size() < 2) return "";
  const auto first = *geoms.begin(), last = *geoms.rbegin();
  const bool there = std::binary_search(last_.begin(), last_.end(), Pair(first.first, last.first));
  if (dParallelSAPSpaceFindPair(space, first.second, last.second, &number) != there)
    return "a pair is found that is none";
  return "";
}

// What is wrong about a touch that began.
std::string EventsOracle::beginTouch(dSpaceID space, const Pair& touch, const Event& event,
                                     const Geoms& geoms) {
  const Pair top(number(topOf(space, event.o1)), number(topOf(space, event.o2)));
  const bool within = isWithin(touch, geoms);
  if (!within && number(event.o1) != touch.first) return "geoms of a touch are turned";
  const auto found = std::find(last_.begin(), last_.end(), ascending(top.first, top.second));
  if (found != last_.begin() + static_cast<std::ptrdiff_t>(event.place))
    return "a touch has another place";
  const unsigned owed = within ? takeNumber() : known_.at(touch).number;
  return owed == event.number ? "" : "a touch has another number";
}

std::string EventsOracle::checkTouches(dSpaceID space, const Pairs& touches, const Geoms& geoms,
                                       const Geoms& within) {
  std::set<Pair> now, begun;
  for (const Pair& touch : touches) now.insert(ascending(touch.first, touch.second));
  Geoms all = geoms;
  all.insert(within.begin(), within.end());
  // Ended ones may come in any order of their geoms, if these are in sub-spaces.
  using Ended = std::tuple<std::size_t, unsigned, std::set<dGeomID>>;
  std::multiset<Ended> owed, told;
  for (auto touch = touches_.begin(); touch != touches_.end();) {
    const auto& [pair, is] = *touch;
    if (now.count(pair) || restOf(space, geoms, pair) != Rest::no) {
      ++touch;
      continue;
    }
    if (is.within || held_.erase(is.number)) ended_numbers_.push_back(is.number);
    owed.insert({is.place, is.number, {geomOf(all, pair.first), geomOf(all, pair.second)}});
    touch = touches_.erase(touch);
  }
  const Events ended = endedTouchesOf(space);
  for (const Event& event : ended) told.insert({event.place, event.number, {event.o1, event.o2}});
  if (owed != told) return "ended touches differ";

  const Events events = begunTouchesOf(space);
  for (const Events* const list : {&ended, &events})
    for (std::size_t i = 1; i < list->size(); ++i)
      if ((*list)[i].place < (*list)[i - 1].place) return "touches are not by place";
  for (const Event& event : events) {
    const Pair touch = ascending(number(event.o1), number(event.o2));
    if (!now.count(touch)) return "a touch began that is none";
    if (touches_.count(touch)) return "a touch began that lasts";
    const std::string problem = beginTouch(space, touch, event, geoms);
    if (problem != "") return problem;
    touches_[touch] = {event.number, event.place, isWithin(touch, geoms)};
  }
  begun_ += events.size();
  ended_ += ended.size();
  for (const Pair& touch : now) {
    const auto found = touches_.find(touch);
    if (found == touches_.end()) return "a touch did not begin";
    if (!found->second.within) {
      found->second.place = known_.at(touch).place;
    } else {
      const dGeomID a = all.at(touch.first), b = all.at(touch.second);
      const Pair top = ascending(number(topOf(space, a)), number(topOf(space, b)));
      found->second.place = known_.at(top).place;
    }
  }
  return "";
}

std::string EventsOracle::checkNoTouches(dSpaceID space) {
  return begunTouchesOf(space).empty() && endedTouchesOf(space).empty() ? "" : "touches changed";
}

}  // namespace sap_test
