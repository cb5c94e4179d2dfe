// Plays the scenes, in the precision of the ODE that it is built with:
//
//     physics-rows list             the names of all scenes but machines
//     physics-rows row NAME         one extreme, as two lines of CSV: names and values
//     physics-rows machines         in how many of ten starts each machine holds, by setting
//     physics-rows truth            scenes with a known answer, by setting
//     physics-rows swept            swept contacts
//     physics-rows check            holds the last two against limits
//
// The row of an extreme has the outcome with two kinds of pairs, whether they are the same bit for
// bit, and in how many of ten starts the scene does what it owes.

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <ctime>
#include <iostream>

#include "extreme.h"

namespace sap_test::physics {
namespace {

const char* const kNames =
    "precision,theme,extreme,simple,ours,same_bits,held,sink,shift,creep,depth,speed,gain,"
    "lost,gap";

void writeRow(const Extreme& extreme) {
  const Result simple = play(extreme, Pairing::simple_in_our_order, {});
  const Result ours = play(extreme, Pairing::ours, {});
  const Measures& m = ours.measures;
  std::cout << kNames << "\n"
            << (sizeof(dReal) == 8 ? "double" : "single") << "," << extreme.theme << ",\""
            << extreme.name << "\"," << simple.outcome << "," << ours.outcome << ","
            << same(ours, simple) << "," << startsHeld(extreme, {});
  for (const double value : {m.sink, m.shift, m.creep, m.depth, m.speed, m.gain, m.lost, m.gap})
    std::cout << "," << value;
  std::cout << "\n";
}

Setting& add(std::vector<Setting>& settings, const char* name) {
  settings.emplace_back().name = name;
  return settings.back();
}

void writeMachines() {
  std::vector<Setting> settings(1);
  add(settings, "1/4 of the step").divide = 4;
  add(settings, "1/16 of the step").divide = 16;
  add(settings, "100 iterations").iterations = 100;
  add(settings, "dWorldStep").exact = true;
  std::cout << "machine,step_s,setting,held,outcome,off\n";
  for (const Extreme& machine : machines())
    for (const Setting& setting : settings) {
      const Result result = play(machine, Pairing::ours, setting);
      const double off =
          machine.demand == Demand::hold ? result.measures.gap : result.measures.shift;
      std::cout << '"' << machine.name << "\"," << machine.step << ",\"" << setting.name << "\","
                << startsHeld(machine, setting) << "," << result.outcome << "," << off << std::endl;
    }
}

// Over all runs: a share has Wilson's interval of 95 %.
struct Errors {
  std::string quantity;
  double value = 0, exact = 0, mean = 0, least = 1e300, most = 0;
  bool is_share = false;
};

std::vector<Errors> errorsOf(const Scene& scene, Setting setting) {
  std::vector<Errors> all;
  for (int run = 0; run < scene.runs; ++run) {
    setting.start = unsigned(run) + 1;
    const Quantities found = scene.play(setting, run);
    all.resize(found.size());
    for (std::size_t q = 0; q < found.size(); ++q) {
      Errors& errors = all[q];
      errors.quantity = found[q].name;
      errors.is_share = found[q].scale == 0;
      const double scale = errors.is_share ? 1 : found[q].scale;
      const double error = std::fabs(found[q].value - found[q].exact) / scale;
      errors.value += found[q].value / scene.runs;
      errors.exact += found[q].exact / scene.runs;
      errors.mean += error / scene.runs;
      errors.least = std::min(errors.least, error);
      errors.most = std::max(errors.most, error);
    }
  }
  for (Errors& share : all) {
    if (!share.is_share) continue;
    const double p = share.mean, n = scene.runs, z2 = 1.96 * 1.96, middle = p + z2 / (2 * n);
    const double half = std::sqrt(z2 * (p * (1 - p) / n + z2 / (4 * n * n)));
    share.least = std::max(0.0, (middle - half) / (1 + z2 / n));
    share.most = std::min(1.0, (middle + half) / (1 + z2 / n));
  }
  return all;
}

// What is changed: one thing at a time.
std::vector<Setting> settingsOf(const Scene& scene) {
  std::vector<Setting> all(1);
  if (scene.kind == Scene::swept) {
    all[0].name = "dCollide";
    add(all, "swept contacts").swept = true;
    return all;
  }
  add(all, "1/4 of the step").divide = 4;
  if (scene.name != "elastic balls") add(all, "dWorldStep").exact = true;
  if (scene.kind == Scene::free) return all;
  add(all, "100 iterations").iterations = 100;
  add(all, "ERP 0.8").erp = 0.8;
  add(all, "CFM = step / mass").soft = true;
  return all;
}

void writeErrors(const std::vector<Scene>& scenes) {
  std::cout << "scene,of,quantity,setting,dt,us_a_step,value,exact,error,least,most\n";
  std::cout.precision(4);
  for (const Scene& scene : scenes)
    for (const Setting& s : settingsOf(scene)) {
      const long steps_before = Stage::steps_of_all;
      const std::clock_t before = std::clock();
      const std::vector<Errors> all = errorsOf(scene, s);
      const double cost = 1e6 * double(std::clock() - before) / CLOCKS_PER_SEC /
                          double(Stage::steps_of_all - steps_before);
      for (const Errors& e : all)
        if (e.quantity != "momentum")  // only checked
          std::cout << '"' << scene.name << "\",\"" << scene.of << "\"," << e.quantity << ",\""
                    << s.name << "\"," << 0.01 / s.divide << "," << cost << "," << e.value << ","
                    << e.exact << "," << e.mean << "," << e.least << "," << e.most << std::endl;
    }
}

// Those bounds of a scene that are for this setting.
bool holds(const Scene& scene, const Setting& setting) {
  bool all_hold = true;
  const std::vector<Errors> all = errorsOf(scene, setting);
  for (const Bound& bound : scene.bounds) {
    bool within = false;  // also if nothing is measured
    for (const Errors& e : all)
      if (e.quantity == bound.quantity)
        within = e.mean >= bound.least && e.mean <= bound.mean && e.most <= bound.most;
    if (!within) std::cout << scene.name << ", " << setting.name << ": " << bound.quantity << "\n";
    all_hold = all_hold && within;
  }
  return all_hold;
}

bool check() {
  bool all_hold = true;
  Setting setting;
  setting.divide = 4;
  setting.iterations = 50;
  setting.cfm = 1e-10;
  for (const Scene& scene : truthScenes())
    all_hold &= scene.bounds.empty() || holds(scene, setting);
  for (const Scene& scene : sweptScenes())
    for (const Setting& how : settingsOf(scene))
      if (how.swept) all_hold &= holds(scene, how);
  return all_hold;
}

int run(const std::string& what, const std::string& name) {
  dSetMessageHandler([](int, const char*, va_list) {});  // of dWorldStep
  if (what == "machines") return writeMachines(), 0;
  for (const Extreme& extreme : extremes()) {
    if (what == "list") std::cout << extreme.name << "\n";
    if (what == "row" && extreme.name == name) return writeRow(extreme), 0;
  }
  for (const std::vector<Scene>& scenes : {truthScenes(), sweptScenes()})
    for (const Scene& scene : scenes)
      if (what == "list") std::cout << scene.name << "\n";
  if (what == "list") return 0;
  if (what == "truth") return writeErrors(truthScenes()), 0;
  if (what == "swept") return writeErrors(sweptScenes()), 0;
  if (what == "check") return check() ? 0 : 1;
  std::cerr << "physics-rows list, row NAME, machines, truth, swept, or check\n";
  return 2;
}

}  // namespace
}  // namespace sap_test::physics

int main(int argc, char** argv) {
  dInitODE2(0);
  dAllocateODEDataForThread(dAllocateMaskAll);
  return sap_test::physics::run(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
}
