// What the harness does with what a scene gives it.
#include <iostream>

#include "harness.h"

namespace {

int failures = 0;

void check(bool is_so, const char* what) {
  if (!is_so) std::cerr << "not so: " << what << "\n";
  failures += !is_so;
}

double measured(const tradeoff::Scene& scene, const tradeoff::Settings& settings,
                const std::string& column) {
  std::istringstream lines(tradeoff::harness::measure(scene, settings));
  std::string names, values;
  std::getline(lines, names);
  std::getline(lines, values);
  std::istringstream name_of(names), value_of(values);
  for (std::string name, value;
       std::getline(name_of, name, ',') && std::getline(value_of, value, ',');)
    if (name == column) return std::stod(value);
  throw std::out_of_range(column);
}

dBodyID addBox(dWorldID world, dSpaceID space, double x, double z, double wide, double high) {
  const dBodyID body = dBodyCreate(world);
  dMass mass;
  dMassSetBox(&mass, 1000, 1, 1, 1);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, dReal(x), 0, dReal(z));
  dGeomSetBody(dCreateBox(space, dReal(wide), dReal(wide), dReal(high)), body);
  return body;
}

// Two boxes, half in each other, over a plane.
void buildOverlapping(dWorldID world, dSpaceID space, unsigned long) {
  dCreatePlane(space, 0, 0, 1, 0);
  for (double x : {0.0, 0.5}) addBox(world, space, x, 0.5, 1, 1);
}

void testUnwantedContacts() {
  tradeoff::Scene scene;
  scene.build = buildOverlapping;
  tradeoff::Settings settings;
  check(measured(scene, settings, "impact_mm") > 400, "what overlaps is deep");
  scene.surface = [](dContact& contact) {
    return !dGeomGetBody(contact.geom.g1) || !dGeomGetBody(contact.geom.g2);
  };
  check(measured(scene, settings, "impact_mm") < 10, "what may go through each other has no depth");
  check(measured(scene, settings, "height_m") > 0.45, "what the scene wants still holds");
}

void testOrder() {
  tradeoff::Scene scene;
  std::string calls;
  double step = 0;
  scene.build = [&](dWorldID world, dSpaceID space, unsigned long seed) {
    calls += 'b';
    buildOverlapping(world, space, seed);
  };
  scene.prepare = [&](double dt) {
    calls += 'p';
    step = dt;
  };
  scene.control = [&](double time) {
    if (time == 0) calls += 'c';
  };
  scene.observe = [&] {
    calls += 'o';
    return std::vector<tradeoff::Observation>{};
  };
  tradeoff::Settings settings;
  settings.dt = 0.02;
  tradeoff::harness::measure(scene, settings);
  check(calls == "bpco", "built, prepared, driven and observed, once each");
  check(step == 0.02, "prepared with the step");
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

void testKinematicBodies() {
  const tradeoff::Scene scene = carriedBox();
  const tradeoff::Settings settings;
  check(measured(scene, settings, "bodies_seen") == 1, "kinematic bodies are not counted");
  check(measured(scene, settings, "size_m") < 1.01, "nor are their sizes");
  check(measured(scene, settings, "energy_gain") < 0.01, "nor is their energy");
  observed = 0;
  const double mean = measured(scene, settings, "observed_time");
  check(observed == 11, "observed each tenth step from a second on");
  check(mean > 1.4 && mean < 1.6, "what was observed is a mean");
}

void testNamesThatAreTaken() {
  tradeoff::Scene scene = carriedBox();
  scene.ignores = "height";
  for (const char* name : {"height", "spread", "jitter", "energy", "drift"}) {
    scene.observe = [name] { return std::vector<tradeoff::Observation>{{name, 1, 1}}; };
    char program[] = "own";
    char* arguments[] = {program, nullptr};
    check(tradeoff::run(1, arguments, scene) == 2, "no observation has a built-in outcome's name");
  }
}

void testSoftness() {
  tradeoff::Scene scene = carriedBox();
  tradeoff::Settings settings;
  dWorldID world = nullptr;
  scene.build = [&, build = scene.build](dWorldID of, dSpaceID space, unsigned long seed) {
    build(world = of, space, seed);
  };
  scene.observe = [&] {
    return std::vector<tradeoff::Observation>{{"cfm", double(dWorldGetCFM(world)), 1}};
  };
  char program[] = "own", name[] = "--cfm", value[] = "step/mass";
  char* arguments[] = {program, name, value};
  settings = tradeoff::parseSettings(3, arguments);
  const double cfm = measured(scene, settings, "observed_cfm");
  check(std::abs(cfm - settings.dt / 1000) < 1e-8, "CFM is the step by the lightest body's mass");
}

void testHelp() {
  char program[] = "own", wrong[] = "--wrong", value[] = "1", asked[] = "--help";
  char* arguments[] = {program, asked};
  check(tradeoff::run(2, arguments, carriedBox()) == 0, "help is no error");
  try {
    tradeoff::parseSettings(2, arguments);
    check(false, "help is given");
  } catch (const tradeoff::Help& help) {
    check(help.text.find(" --dt") != std::string::npos, "help names the settings");
  }
  char* others[] = {program, wrong, value};
  check(tradeoff::run(3, others, carriedBox()) == 2, "a setting that is none is an error");
}

}  // namespace

// With arguments it is a program that has its scene studied.
int main(int argc, char** argv) {
  if (argc > 1) return tradeoff::run(argc, argv, carriedBox());
  testUnwantedContacts();
  testOrder();
  testKinematicBodies();
  testNamesThatAreTaken();
  testSoftness();
  testHelp();
  return failures ? 1 : 0;
}
