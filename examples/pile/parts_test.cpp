// Tests the parts of pile whose effects no run shows for certain. Ends with 0 if all hold.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "check.h"
#include "letters.h"
#include "scenes.h"
#include "shapes.h"

namespace pile {
namespace {

int failures = 0;

void check(bool holds, const std::string& text) {
  std::printf("%s: %s\n", holds ? "ok" : "WRONG", text.c_str());
  if (!holds) ++failures;
}

void build(World& world, const Preset& preset, int bodies) {
  Random random(1);
  preset.build(world, bodies, random);
}

void testStart(const Preset& preset) {
  World world;
  build(world, preset, 100);
  bool at_rest = true, above = true;
  std::set<double> turns;
  for (dBodyID body : world.bodies()) {
    const dReal* speed = dBodyGetLinearVel(body);
    const dReal* rotation = dBodyGetAngularVel(body);
    for (int i = 0; i < 3; ++i) at_rest = at_rest && speed[i] == 0 && rotation[i] == 0;
    const dReal* place = dBodyGetPosition(body);
    above = above && place[2] > world.ground_height(place[0], place[1]) + 0.5;
    turns.insert(dBodyGetQuaternion(body)[0]);
  }
  const std::string name = preset.name;
  check(at_rest, name + ": the bodies start at rest");
  check(above && world.state().lost == 0, name + ": they are above the ground");
  check(turns.size() == 100, name + ": each is turned in its own way");
}

void testLetters() {
  std::set<std::vector<Mesh::Point>> shapes;
  double least = 1;
  for (int variation = 0; variation < letter_variation_count; ++variation)
    for (int letter = 0; letter < letter_count; ++letter) {
      Mesh mesh = makeLetter(letter, variation);
      shapes.insert(mesh.points);
      least = std::min(least, double(centreOfMass(mesh, 1).mass));
    }
  check(shapes.size() == 260, "all 260 letters are different");
  check(least > 0.01,
        "all are closed, with their front outside: the least mass is " + std::to_string(least));
}

void testMeshes() {
  Mesh pin = makeSkittle(1.5, 100);
  pin.triangles.pop_back();
  std::string said;
  try {
    centreOfMass(pin, 1);
  } catch (const std::exception& error) {
    said = error.what();
  }
  check(said.find("closed") != std::string::npos, "a mesh with a hole is refused: " + said);
}

// What PairCheck says of a list of pairs made from the right one.
std::string saidOf(PairCheck& pair_check, const World& world,
                   const std::function<void(std::vector<Pair>&)>& spoil) {
  const std::vector<dGeomID>& geoms = world.geoms();
  std::vector<Pair> pairs;
  for (size_t a = 0; a < geoms.size(); ++a)
    for (size_t b = a + 1; b < geoms.size(); ++b) {
      dReal first[6], second[6];
      dGeomGetAABB(geoms[a], first);
      dGeomGetAABB(geoms[b], second);
      bool overlap = dGeomGetBody(geoms[a]) || dGeomGetBody(geoms[b]);
      for (int i = 0; i < 6; i += 2)
        overlap = overlap && first[i] <= second[i + 1] && second[i] <= first[i + 1];
      if (overlap) pairs.push_back({geoms[a], geoms[b]});
    }
  spoil(pairs);
  return pair_check.compare(pairs, true).value_or("");
}

void testCheck() {
  World world;
  build(world, presetOf("balls"), 8);
  for (dBodyID body : world.bodies()) dBodySetPosition(body, 0, 0, 5);  // each meets each
  PairCheck pair_check(world.geoms());
  const auto has = [&](const std::string& text, const std::function<void(std::vector<Pair>&)>& f) {
    const std::string said = saidOf(pair_check, world, f);
    check(text.empty() ? said.empty() : said.find(text) != std::string::npos,
          "the check says '" + text + "': '" + said + "'");
  };
  has("", [](std::vector<Pair>&) {});
  has("is missing", [](std::vector<Pair>& pairs) { pairs.pop_back(); });
  has("is reported twice", [](std::vector<Pair>& pairs) { pairs.push_back(pairs.front()); });
  has("out of order", [](std::vector<Pair>& pairs) { std::swap(pairs[3], pairs[9]); });
  has("has its later geom first",
      [](std::vector<Pair>& pairs) { std::swap(pairs[3].first, pairs[3].second); });
}

void testLost() {
  World world;
  build(world, presetOf("cubes"), 3);
  dBodySetPosition(world.bodies()[0], 0, 0, -9);
  dBodySetPosition(world.bodies()[1], std::nan(""), 0, 0);
  check(world.state().lost == 2, "bodies below the ground or nowhere are lost");
}

}  // namespace
}  // namespace pile

int main() {
  for (const pile::Preset& preset : pile::presets()) pile::testStart(preset);
  pile::testLetters();
  pile::testMeshes();
  pile::testCheck();
  pile::testLost();
  return pile::failures == 0 ? 0 : 1;
}
