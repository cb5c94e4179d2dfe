#include "events_oracle.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "rules_oracle.h"

namespace sap_test {
namespace {

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

Events eventsOf(dSpaceID space, std::size_t (*get)(dSpaceID, const dParallelSAPPairEvent**)) {
  const dParallelSAPPairEvent* pairs = nullptr;
  const std::size_t count = get(space, &pairs);
  if ((count == 0) != (pairs == nullptr)) throw std::logic_error("a list and its length differ");
  Events events;
  for (std::size_t i = 0; i < count; ++i)
    events.push_back({pairs[i].o1, pairs[i].o2, pairs[i].place, pairs[i].number});
  return events;
}

std::vector<unsigned> numbersOf(dSpaceID space) {
  const unsigned* numbers = nullptr;
  const std::size_t count = dParallelSAPSpaceGetPairNumbers(space, &numbers);
  return std::vector<unsigned>(numbers, numbers + count);
}

std::string Followed::follow(const Events& begun, const Events& ended) {
  for (const Event& event : ended) {
    const auto known = lasting_.find(event.number);
    if (known == lasting_.end()) return "what ended had not begun";
    const auto& [first, second] = known->second;
    const auto may_be = [&](std::size_t a, std::size_t b) {
      return (!event.o1 || number(event.o1) == a) && (!event.o2 || number(event.o2) == b);
    };
    // In sub-spaces the two may have changed places meanwhile.
    if (!may_be(first, second) && !may_be(second, first)) return "what ended were other geoms";
  }
  for (const Event& event : begun)
    if (!lasting_.emplace(event.number, Pair(number(event.o1), number(event.o2))).second)
      return "two have one number";
  for (const Event& event : ended) lasting_.erase(event.number);
  return "";
}

Pairs Followed::lasting() const {
  Pairs pairs;
  for (const auto& [number, pair] : lasting_) pairs.push_back(pair);
  return asSet(pairs);
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
  if (!(dParallelSAPSpaceGetEvents(space) & dParallelSAPEventPairs))
    return begunOf(space).empty() && endedOf(space).empty() && numbersOf(space).empty()
               ? ""
               : "pairs are told that are off";
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

// The place of the pair that a touch is or is in, or of the first pair of the sub-space around it.
std::size_t EventsOracle::placeOf(dSpaceID space, dGeomID a, dGeomID b, const Names& names) const {
  const Pair top = ascending(names.at(topOf(space, a)), names.at(topOf(space, b)));
  const auto isOf = [&](const Pair& pair) {
    return top.first == top.second ? pair.first == top.first || pair.second == top.first
                                   : pair == top;
  };
  return static_cast<std::size_t>(std::find_if(last_.begin(), last_.end(), isOf) - last_.begin());
}

// What is wrong about touches that began, in the order of all.
std::string EventsOracle::beginTouches(dSpaceID space, const Pairs& touches, const Geoms& geoms,
                                       const Names& names) {
  auto next = touches.begin();
  for (const Event& event : begunTouchesOf(space)) {
    const Pair reported(names.at(event.o1), names.at(event.o2));
    next = std::find(next, touches.end(), reported);
    if (next == touches.end()) return "a touch began that is none, or out of order";
    const Pair touch = ascending(reported.first, reported.second);
    const bool within = isWithin(touch, geoms);
    if (!touches_.emplace(touch, Known{event.number, event.place, within}).second)
      return "a touch began that lasts";
    if (event.place != placeOf(space, event.o1, event.o2, names)) return "a touch at another place";
    if (event.number != (within ? takeNumber() : known_.at(touch).number))
      return "a touch has another number";
  }
  return "";
}

// Ended ones may come in any order of their geoms, if these are in sub-spaces.
std::string EventsOracle::endTouches(dSpaceID space, const std::set<Pair>& now, const Geoms& geoms,
                                     const Geoms& all) {
  using Ended = std::tuple<std::size_t, unsigned, std::set<dGeomID>>;
  std::multiset<Ended> owed, told;
  std::size_t place = 0;
  for (const Event& event : endedTouchesOf(space)) {
    told.insert({event.place, event.number, {event.o1, event.o2}});
    if (event.place < place) return "touches are not by place";
    place = event.place;
  }
  for (auto touch = touches_.begin(); touch != touches_.end();) {
    const auto& [pair, is] = *touch;
    const Ended ended = {is.place, is.number, {geomOf(all, pair.first), geomOf(all, pair.second)}};
    const Rest rest = now.count(pair) ? Rest::yes : restOf(space, geoms, pair);
    if (rest == Rest::yes || (rest == Rest::either && !told.count(ended))) {
      ++touch;
      continue;
    }
    if (is.within || held_.erase(is.number)) ended_numbers_.push_back(is.number);
    owed.insert(ended);
    touch = touches_.erase(touch);
  }
  return owed == told ? "" : "ended touches differ";
}

std::string EventsOracle::checkTouches(dSpaceID space, const Pairs& touches, const Geoms& geoms,
                                       const Geoms& within) {
  std::set<Pair> now;
  for (const Pair& touch : touches) now.insert(ascending(touch.first, touch.second));
  Geoms all = geoms;
  all.insert(within.begin(), within.end());
  Names names;
  for (const auto& [name, geom] : all) names[geom] = name;
  std::string problem = endTouches(space, now, geoms, all);
  if (problem == "") problem = beginTouches(space, touches, geoms, names);
  if (problem != "") return problem;
  for (const Pair& touch : now) {
    const auto found = touches_.find(touch);
    if (found == touches_.end()) return "a touch did not begin";
    found->second.place = placeOf(space, all.at(touch.first), all.at(touch.second), names);
  }
  return "";
}

}  // namespace sap_test
