#include "recorder.h"

#include <algorithm>
#include <cstdint>
#include <sstream>

namespace sap_test {

void setNumber(dGeomID geom, std::size_t number) {
  dGeomSetData(geom, reinterpret_cast<void*>(static_cast<std::uintptr_t>(number)));
}

std::size_t number(dGeomID geom) {
  return static_cast<std::size_t>(reinterpret_cast<std::uintptr_t>(dGeomGetData(geom)));
}

void record(void* pairs, dGeomID first, dGeomID second) {
  static_cast<Pairs*>(pairs)->emplace_back(number(first), number(second));
}

void recordWithin(void* pairs, dGeomID first, dGeomID second) {
  if (dGeomIsSpace(first) || dGeomIsSpace(second))
    dSpaceCollide2(first, second, pairs, recordWithin);
  else
    record(pairs, first, second);
}

Pairs collide(dSpaceID space) {
  Pairs pairs;
  dSpaceCollide(space, &pairs, record);
  return pairs;
}

Pairs collideUntil(dSpaceID space, std::size_t at) {
  struct Stop {};
  Pairs pairs;
  try {
    collide(space, [&](dGeomID a, dGeomID b) {
      record(&pairs, a, b);
      if (pairs.size() == at) throw Stop();
    });
  } catch (const Stop&) {
  }
  return pairs;
}

Pairs collide2(dGeomID first, dGeomID second) {
  Pairs pairs;
  dSpaceCollide2(first, second, &pairs, record);
  return pairs;
}

Pairs sorted(Pairs pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

Pairs asSet(Pairs pairs) {
  for (Pair& pair : pairs) {
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  return sorted(std::move(pairs));
}

std::string difference(const Pairs& got, const Pairs& expected) {
  const std::size_t common = std::min(got.size(), expected.size());
  std::size_t at = 0;
  while (at < common && got[at] == expected[at]) ++at;
  if (at == got.size() && at == expected.size()) return "";

  const auto show = [at](const Pairs& pairs) {
    std::ostringstream text;
    for (std::size_t i = at; i < std::min(at + 3, pairs.size()); ++i) {
      text << " (" << pairs[i].first << "," << pairs[i].second << ")";
    }
    if (at + 3 < pairs.size()) text << " ...";
    if (at >= pairs.size()) text << " nothing";
    return text.str();
  };
  std::ostringstream text;
  text << "from pair " << at << " on: got" << show(got) << " of " << got.size() << ", expected"
       << show(expected) << " of " << expected.size();
  return text.str();
}

}  // namespace sap_test
