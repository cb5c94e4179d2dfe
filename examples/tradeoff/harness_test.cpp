// What the harness does with what a scene gives it.
#include <iostream>

#include "harness.h"

namespace {

int failures = 0;

void check(bool is_so, const char* what) {
  if (!is_so) std::cerr << "not so: " << what << "\n";
  failures += !is_so;
}

using tradeoff::harness::measure;
using Values = std::map<std::string, double>;

dBodyID addBox(dWorldID world, dSpaceID space, double x, double z, double wide, double high) {
  const dBodyID body = dBodyCreate(world);
  dMass mass;
  dMassSetBox(&mass, 1000, 1, 1, 1);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, dReal(x), 0, dReal(z));
  dGeomSetBody(dCreateBox(space, dReal(wide), dReal(wide), dReal(high)), body);
  return body;
}

// Two boxes, half in each other, over a plane; each in a space of its own.
tradeoff::Scene overlapping() {
  tradeoff::Scene scene;
  scene.build = [](dWorldID world, dSpaceID space, unsigned long) {
    dCreatePlane(space, 0, 0, 1, 0);
    for (double x : {0.0, 0.5}) addBox(world, dSimpleSpaceCreate(space), x, 0.5, 1, 1);
  };
  scene.seconds = 2;
  return scene;
}

void testUnwantedContacts() {
  tradeoff::Scene scene = overlapping();
  const tradeoff::Settings settings;
  check(measure(scene, settings)["outcome_energy"] > 0.1, "what overlaps is driven apart");
  scene.surface = [](dContact& contact) {
    return !dGeomGetBody(contact.geom.g1) || !dGeomGetBody(contact.geom.g2);
  };
  Values found = measure(scene, settings);
  check(found["outcome_energy"] < 0.01, "what may go through each other stays");
  check(std::fabs(found["outcome_height"] - 0.5) < 0.01, "what the scene wants still holds");
}

int observed = 0;
double last = 0;

// A kinematic plate, which is larger and higher than all else, carries a box.
tradeoff::Scene carriedBox() {
  tradeoff::Scene scene;
  scene.build = [](dWorldID world, dSpaceID space, unsigned long) {
    addBox(world, space, 0, 0.5, 1, 1);
    dBodySetKinematic(addBox(world, space, 0, -1, 40, 2));
  };
  scene.control = [](double time) { last = time; };
  scene.observe = [] {
    ++observed;
    return std::vector<tradeoff::Observation>{{"time", last, 1}};
  };
  scene.observe_every = 10;
  scene.observe_from = 1;
  scene.rests = false;
  scene.seconds = 2;
  return scene;
}

void testOutcomes() {
  tradeoff::Scene scene = carriedBox();
  const tradeoff::Settings settings;
  observed = 0;
  Values found = measure(scene, settings);
  check(observed == 11, "observed each tenth step from a second on");
  check(std::fabs(found["outcome_time"] - 1.49) < 1e-9, "what was observed is a mean");
  check(std::fabs(found["outcome_height"] - 0.5) < 0.01, "kinematic bodies do not count");
  check(!found.count("outcome_jitter") && !found.count("outcome_energy"),
        "what does not rest may be fast, and what is driven may gain energy");
  scene.rests = true;
  scene.control = nullptr;
  scene.ignores = "height+spread";
  found = measure(scene, settings);
  check(found.count("outcome_jitter") && found.count("outcome_energy"), "else neither may");
  check(!found.count("outcome_height") && !found.count("outcome_spread"),
        "a scene may ignore some");
}

void testOrderAndSoftness() {
  tradeoff::Scene scene = overlapping();
  std::string calls;
  dWorldID world = nullptr;
  scene.build = [&, build = scene.build](dWorldID of, dSpaceID space, unsigned long seed) {
    calls += 'b';
    build(world = of, space, seed);
  };
  scene.prepare = [&](double dt) { calls += "p " + std::to_string(dt) + " "; };
  scene.control = [&](double time) { calls += time == 0 ? "c" : ""; };
  scene.observe = [&] {
    calls += 'o';
    return std::vector<tradeoff::Observation>{{"cfm", double(dWorldGetCFM(world)), 1}};
  };
  const char* words[] = {"own", "--cfm", "step/mass", "--dt", "0.02"};
  Values found = measure(scene, tradeoff::harness::parseSettings(5, const_cast<char**>(words)));
  check(calls == "bp 0.020000 co", "built, prepared with the step, driven, observed, once each");
  check(std::fabs(found["outcome_cfm"] - 2e-5) < 1e-8, "CFM is the step by the lightest mass");
}

void testExitCodes() {
  const auto ends = [](std::vector<const char*> words, const tradeoff::Scene& scene) {
    words.insert(words.begin(), "own");
    return tradeoff::run(int(words.size()), const_cast<char**>(words.data()), scene);
  };
  tradeoff::Scene scene = carriedBox();
  check(ends({"--help"}, scene) == 0, "help is no error");
  check(ends({"--wrong", "1"}, scene) == 2, "a setting that is none is an error");
  for (const char* name : {"height", "a-b", ""}) {
    scene.observe = [name] { return std::vector<tradeoff::Observation>{{name, 1, 1}}; };
    check(ends({}, scene) == 2, "an observation's name is a word that no outcome has");
  }
  scene.build = [](dWorldID world, dSpaceID space, unsigned long) {
    dBodySetLinearVel(addBox(world, space, 0, 0, 1, 1), dInfinity, 0, 0);
  };
  check(ends({}, scene) == 1, "a body that is nowhere ends the run");
}

}  // namespace

// With arguments it is a program that has its scene studied.
int main(int argc, char** argv) {
  if (argc > 1) return tradeoff::run(argc, argv, carriedBox());
  testUnwantedContacts();
  testOutcomes();
  testOrderAndSoftness();
  testExitCodes();
  return failures ? 1 : 0;
}
