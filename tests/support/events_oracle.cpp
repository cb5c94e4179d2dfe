#include "events_oracle.h"

#include <algorithm>
#include <stdexcept>

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

}  // namespace

Events begunOf(dSpaceID space) {
  return eventsOf(dParallelSAPSpaceGetBegunPairs, space);
}

Events endedOf(dSpaceID space) {
  return eventsOf(dParallelSAPSpaceGetEndedPairs, space);
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

void EventsOracle::adopt(dSpaceID space, const Pairs& pairs) {
  *this = EventsOracle();
  const std::vector<unsigned> numbers = numbersOf(space);
  for (std::size_t place = 0; place < pairs.size(); ++place)
    numbers_[pairs[place]] = numbers.at(place);
  for (const Event& event : endedOf(space)) ended_numbers_.push_back(event.number);
  last_ = pairs;
  std::set<unsigned> used(numbers.begin(), numbers.end());
  used.insert(ended_numbers_.begin(), ended_numbers_.end());
  next_ = used.empty() ? 0 : *used.rbegin() + 1;
  for (unsigned number = 0; number < next_; ++number)
    if (!used.count(number)) free_.insert(number);
  most_ = next_;
}

Events EventsOracle::end(const Pairs& pairs, const Geoms& geoms) {
  const std::set<Pair> now(pairs.begin(), pairs.end());
  Events ended;
  for (std::size_t place = 0; place < last_.size(); ++place) {
    const Pair& pair = last_[place];
    if (now.count(pair)) continue;
    const unsigned number = numbers_.at(pair);
    ended.push_back({geomOf(geoms, pair.first), geomOf(geoms, pair.second), place, number});
    ended_numbers_.push_back(number);
    numbers_.erase(pair);
  }
  return ended;
}

Events EventsOracle::begin(const Pairs& pairs, const Geoms& geoms, std::vector<unsigned>& numbers) {
  Events begun;
  for (std::size_t place = 0; place < pairs.size(); ++place) {
    const Pair& pair = pairs[place];
    if (!numbers_.count(pair)) {
      if (free_.empty()) free_.insert(next_++);
      const unsigned free = *free_.begin();
      free_.erase(free_.begin());
      numbers_[pair] = free;
      begun.push_back({geomOf(geoms, pair.first), geomOf(geoms, pair.second), place, free});
    }
    numbers.push_back(numbers_[pair]);
  }
  return begun;
}

std::string EventsOracle::check(dSpaceID space, const Pairs& pairs, const Geoms& geoms) {
  // What ended in the frame before is free from now on.
  free_.insert(ended_numbers_.begin(), ended_numbers_.end());
  ended_numbers_.clear();
  const Events ended = end(pairs, geoms);
  std::vector<unsigned> numbers;
  const Events begun = begin(pairs, geoms, numbers);
  most_ = std::max(most_, pairs.size() + ended.size());
  last_ = pairs;
  begun_ += begun.size();
  ended_ += ended.size();
  if (begunOf(space) != begun) return "begun pairs differ";
  if (endedOf(space) != ended) return "ended pairs differ";
  if (numbersOf(space) != numbers) return "numbers differ";
  for (const unsigned number : numbers)
    if (number >= most_) return "a number is larger than it may be";
  return checkSearch(space, geoms);
}

std::string EventsOracle::checkSearch(dSpaceID space, const Geoms& geoms) const {
  unsigned number = 0;
  for (std::size_t i = 0; i < last_.size(); i += 1 + last_.size() / 50) {
    const dGeomID a = geoms.at(last_[i].first), b = geoms.at(last_[i].second);
    const bool turned = i % 2;
    if (!dParallelSAPSpaceFindPair(space, turned ? b : a, turned ? a : b, &number) ||
        number != numbers_.at(last_[i]))
      return "a pair is not found";
  }
  if (geoms.size() < 2) return "";
  const auto first = *geoms.begin(), last = *geoms.rbegin();
  const bool there = numbers_.count({first.first, last.first}) != 0;
  if (dParallelSAPSpaceFindPair(space, first.second, last.second, &number) != there)
    return "a pair is found that is none";
  return "";
}

}  // namespace sap_test
