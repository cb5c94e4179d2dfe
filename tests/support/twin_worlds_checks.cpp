// What must be the same in the three worlds.
#include <algorithm>

#include "oracle.h"
#include "twin_worlds.h"

namespace sap_test {
namespace {

// Empty sub-spaces are the one thing in which our space owes other pairs than ODE's.
void recordUnlessEmpty(void* pairs, dGeomID a, dGeomID b) {
  if (holdsGeom(a) && holdsGeom(b)) record(pairs, a, b);
}

Pairs collideWithoutEmptySpaces(dSpaceID space) {
  Pairs pairs;
  dSpaceCollide(space, &pairs, recordUnlessEmpty);
  return pairs;
}

Pairs collide2WithoutEmptySpaces(dGeomID a, dGeomID b) {
  Pairs pairs;
  dSpaceCollide2(a, b, &pairs, recordUnlessEmpty);
  return pairs;
}

// As ODE's manual has it: a space in a pair is taken apart. The order of arguments is settled by
// number, since dSpaceCollide2 treats its two arguments differently and the spaces of the three
// worlds report theirs in different orders.
void recordLeaves(void* pairs, dGeomID a, dGeomID b) {
  if (number(a) > number(b)) std::swap(a, b);
  if (dGeomIsSpace(a) || dGeomIsSpace(b)) {
    dSpaceCollide2(a, b, pairs, recordLeaves);
  } else {
    record(pairs, a, b);
  }
}

}  // namespace

std::string TwinWorlds::check() {
  // What is found in one space must not depend on which other was looked at before.
  std::vector<int> spaces;
  for (int i = 0; i < static_cast<int>(objects_.size()); ++i) {
    if (objects_[i].alive && objects_[i].kind == kSpace) spaces.push_back(i);
  }
  for (std::size_t i = spaces.size(); i > 1; --i) {
    std::swap(spaces[i - 1], spaces[random_.below(i)]);
  }
  for (const int space_object : spaces) {
    std::string problem;
    if (random_.chance(0.5)) problem = checkEnumeration(space_object);
    if (problem.empty()) problem = checkPairs(space_object);
    if (problem.empty() && random_.chance(0.3)) problem = checkPairs(space_object);
    if (problem.empty()) problem = checkEnumeration(space_object);
    if (problem.empty()) problem = checkAllTheWayDown(space_object);
    if (!problem.empty()) return "space " + std::to_string(space_object) + ": " + problem;
  }
  return checkCollide2();
}

std::string TwinWorlds::checkEnumeration(int space_object) {
  const dSpaceID ours = space(space_object, kOurs);
  const std::vector<int>& members = objects_[space_object].members;
  if (dSpaceGetNumGeoms(ours) != static_cast<int>(members.size())) {
    return "dSpaceGetNumGeoms: got " + std::to_string(dSpaceGetNumGeoms(ours)) + ", expected " +
           std::to_string(members.size());
  }
  std::vector<int> listed;
  for (int i = 0; i < dSpaceGetNumGeoms(ours); ++i) {
    const dGeomID geom = dSpaceGetGeom(ours, i);
    if (!geom) return "dSpaceGetGeom (" + std::to_string(i) + ") is 0";
    listed.push_back(static_cast<int>(number(geom)));
  }
  std::sort(listed.begin(), listed.end());
  std::vector<int> expected = members;
  std::sort(expected.begin(), expected.end());
  if (listed != expected) return "dSpaceGetGeom does not give every geom exactly once";
  for (int i = 0; i < static_cast<int>(objects_.size()); ++i) {
    const Object& o = objects_[i];
    if (!o.alive) continue;
    if ((dSpaceQuery(ours, o.in[kOurs]) != 0) != (o.parent == space_object)) {
      return "dSpaceQuery is wrong about " + std::to_string(i);
    }
  }
  return "";
}

std::string TwinWorlds::checkPairs(int space_object) {
  std::vector<dGeomID> twins;
  for (const int member : objects_[space_object].members) {
    twins.push_back(objects_[member].in[kSimple]);
  }
  const auto where = [](const char* what, const std::string& problem) {
    return problem.empty() ? problem : std::string(what) + ": " + problem;
  };
  std::string problem;
  if (isStock(space_object, kOurs)) {
    problem = where("a stock space, our world against the simple one",
                    difference(asSet(collide(space(space_object, kOurs))),
                               asSet(collide(space(space_object, kSimple)))));
  } else {
    // Ours first: the oracle asks the twins for their bounds, never our geoms.
    const Pairs got = collide(space(space_object, kOurs));
    const Pairs expected = expectedPairs(twins);
    problem = where("ours against the oracle", difference(got, expected));
    for (const World world : {kSimple, kHash}) {
      if (!problem.empty()) break;
      problem = where(
          world == kSimple ? "ours against dSimpleSpace" : "ours against dHashSpace",
          difference(asSet(got), asSet(collideWithoutEmptySpaces(space(space_object, world)))));
    }
  }
  return problem;
}

std::string TwinWorlds::checkAllTheWayDown(int space_object) {
  std::array<Pairs, kWorlds> leaves;
  for (int world = 0; world < kWorlds; ++world) {
    dSpaceCollide(space(space_object, world), &leaves[world], recordLeaves);
  }
  std::string problem = difference(asSet(leaves[kOurs]), asSet(leaves[kSimple]));
  if (problem.empty()) problem = difference(asSet(leaves[kOurs]), asSet(leaves[kHash]));
  return problem.empty() ? problem : "all sub-spaces taken apart: " + problem;
}

std::string TwinWorlds::checkCollide2() {
  for (int i = 0; i < 8; ++i) {
    int first = pick([](const Object&) { return true; });
    int second = pick([](const Object& o) { return o.kind == kSpace; });
    if (random_.chance(0.1)) first = second;
    if (random_.chance(0.5)) std::swap(first, second);
    const auto found = [&](int world) {
      return collide2WithoutEmptySpaces(objects_[first].in[world], objects_[second].in[world]);
    };
    const Pairs got = found(kOurs), expected = found(kSimple);
    // A space with itself is dSpaceCollide, in which only ours fixes the arguments.
    const std::string problem = first == second ? difference(asSet(got), asSet(expected))
                                                : difference(sorted(got), sorted(expected));
    if (!problem.empty()) {
      return "dSpaceCollide2 (" + std::to_string(first) + ", " + std::to_string(second) +
             "): " + problem;
    }
  }
  return "";
}

}  // namespace sap_test
