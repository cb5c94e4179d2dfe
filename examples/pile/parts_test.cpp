// Tests the parts of pile whose effects no run shows for certain. Ends with 0 if all hold.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "check.h"
#include "letters.h"
#include "motion.h"
#include "presets.h"
#include "report.h"
#include "shapes.h"
#include "spaces.h"
#include "view/coarse_mesh.h"

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

// Half the side of the square that the static meshes cover; 0 for a plane.
double groundReach(const Preset& preset, int bodies) {
  World world;
  build(world, preset, bodies);
  double reach = 0;
  for (dGeomID geom : world.geoms()) {
    if (dGeomGetBody(geom) || dGeomGetClass(geom) == dPlaneClass) continue;
    dReal box[6];
    dGeomGetAABB(geom, box);
    reach = std::max(reach, static_cast<double>(box[1]));
  }
  return reach;
}

void testStart(const Preset& preset) {
  World world;
  build(world, preset, 100);
  const Motion motion = measure(world);
  bool at_rest = true;
  std::set<double> turns;
  for (dBodyID body : world.bodies()) {
    const dReal* speed = dBodyGetLinearVel(body);
    const dReal* rotation = dBodyGetAngularVel(body);
    for (int i = 0; i < 3; ++i) at_rest = at_rest && speed[i] == 0 && rotation[i] == 0;
    turns.insert(dBodyGetQuaternion(body)[0]);
  }
  const std::string name = preset.name;
  check(at_rest && motion.fastest == 0, name + ": the bodies start at rest");
  check(motion.fallen == 0 && motion.lowest > 0.5, name + ": they are above the ground");
  check(turns.size() == 100, name + ": each is turned in its own way");
}

void testSizes() {
  World cubes;
  build(cubes, presetOf("cubes"), 1000);
  double least = 10, most = 0;
  for (dGeomID geom : cubes.geoms()) {
    if (!dGeomGetBody(geom)) continue;
    dVector3 sides;
    dGeomBoxGetLengths(geom, sides);
    least = std::min({least, double(sides[0]), double(sides[1]), double(sides[2])});
    most = std::max({most, double(sides[0]), double(sides[1]), double(sides[2])});
  }
  check(least >= 0.6 && least < 0.61 && most <= 1 && most > 0.99, "boxes are of 0.6 to 1 m");
}

void testBallSizes() {
  World balls;
  build(balls, presetOf("balls"), 1000);
  double least = 10, most = 0;
  for (dGeomID geom : balls.geoms()) {
    if (!dGeomGetBody(geom)) continue;
    least = std::min(least, 2 * double(dGeomSphereGetRadius(geom)));
    most = std::max(most, 2 * double(dGeomSphereGetRadius(geom)));
  }
  check(least >= 0.6 && least < 0.61 && most <= 1 && most > 0.99, "spheres are of 0.6 to 1 m");
}

void testGround() {
  for (const char* name : {"cubes", "balls"}) {
    const Preset& preset = presetOf(name);
    check(groundReach(preset, 4 * preset.bodies) > 1.5 * groundReach(preset, preset.bodies),
          std::string(name) + ": the ground grows with the number of bodies");
  }
}

void testLetters() {
  std::set<std::vector<Mesh::Point>> shapes;
  for (int variation = 0; variation < letter_variation_count; ++variation)
    for (int letter = 0; letter < letter_count; ++letter)
      shapes.insert(makeLetter(letter, variation).points);
  check(shapes.size() == 260, "all 260 letters are different");
}

void testMeshes() {
  Mesh pin = makeSkittle(1.5);
  const Mesh coarse = coarseMesh(pin);
  check(pin.triangles.size() == 20000 && coarse.triangles.size() < 3000 &&
            coarse.triangles.size() > 300,
        "a skittle is drawn with fewer than 3,000 triangles");
  const Mesh torus = makeTorus(0.5, 0.2);
  check(coarseMesh(torus).triangles == torus.triangles, "a torus is drawn as it is");
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

// Every plane of the scenes lies level, so what is culled shows in a space of the command line's
// with an oblique one.
void testCulling() {
  dInitODE2(0);
  for (const bool cull : {false, true}) {
    const char* words[] = {"pile", "--cull-planes"};
    const Options options = *parseOptions(cull ? 2 : 1, const_cast<char**>(words));
    const dSpaceID space = createSpace(options, {});
    dCreatePlane(space, 1, 1, 1, -100);
    dCreateSphere(space, 1);
    dSpaceCollide(space, nullptr, [](void*, dGeomID, dGeomID) {});
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space, &stats);
    check(stats.pairs == (cull ? 0 : 1), cull ? "--cull-planes culls" : "no plane is culled");
    dSpaceDestroy(space);
  }
  dCloseODE();
}

void testFaults() {
  Motion start;
  start.bodies = 3;
  start.energy = 100;
  const auto faultAfter = [&](const std::function<void(Motion&)>& change) {
    MotionLog log(start);
    Motion motion = start;
    change(motion);
    log.add(motion, 0);
    return log.fault();
  };
  check(faultAfter([](Motion& m) { m.energy = 50; }).empty(), "a pile may lose energy");
  check(faultAfter([](Motion& m) { m.energy = 110; }).find("110 %") != std::string::npos,
        "energy that rises is a fault");
  check(faultAfter([](Motion& m) { m.fallen = 2; }).find("2 bodies fell") == 0,
        "bodies that fall through are a fault");
  check(faultAfter([](Motion& m) { m.not_finite = 1; }).find("no number") != std::string::npos,
        "a body that is nowhere is a fault");
  World world;
  build(world, presetOf("cubes"), 3);
  dBodySetPosition(world.bodies()[1], std::numeric_limits<dReal>::quiet_NaN(), 0, 0);
  check(measure(world).not_finite == 1, "a body that is nowhere is counted");
}

void testProgress() {
  for (const auto between : {std::chrono::milliseconds(0), std::chrono::milliseconds(10000)}) {
    std::FILE* const log = std::tmpfile();
    Frame frame;
    {
      ProgressBar progress(4, log, between);
      for (frame.number = 1; frame.number <= 3; ++frame.number) progress.show(frame, Motion{});
    }
    std::rewind(log);
    int lines = 0, step = 0, steps = 0;
    while (std::fscanf(log, "step %d of %d, 0 asleep, %*d s left\n", &step, &steps) == 2)
      lines += step == lines + 1 && steps == 4;
    check(lines == (between.count() ? 0 : 3), "a log has a line each so many seconds");
    std::fclose(log);
  }
}

}  // namespace
}  // namespace pile

int main() {
  for (const pile::Preset& preset : pile::presets()) pile::testStart(preset);
  pile::testSizes();
  pile::testBallSizes();
  pile::testGround();
  pile::testLetters();
  pile::testMeshes();
  pile::testCheck();
  pile::testCulling();
  pile::testFaults();
  pile::testProgress();
  return pile::failures == 0 ? 0 : 1;
}
