#ifndef TRADEOFF_HARNESS_SETTINGS_H
#define TRADEOFF_HARNESS_SETTINGS_H

#include <cstdlib>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace tradeoff {

// What the study varies. The values here are ODE's own where it has any.
struct Settings {
  double dt = 0.01;     // seconds
  int iterations = 20;  // of QuickStep
  int contacts = 4;     // most of a pair
  std::string reducer =
      "first";         // first: as dCollide gives them; deepest, spread: dParallelSAPKeep*
  double erp = 0.2;    // the part of an error of a joint that one step mends
  double cfm = 1e-10;  // how far constraints give, s^2/kg
  double sor = 1.3;    // the weight of QuickStep's over-relaxation
  std::string solver = "quick";  // quick: dWorldQuickStep, step: dWorldStep
  std::string sleep = "off";     // on: bodies are disabled by ODE's own thresholds
  unsigned long seed = 1;
  double seconds = 0;  // simulated at most; 0: as the scene says
};

// Reads "--name value" pairs; throws std::invalid_argument where one is wrong.
inline Settings parseSettings(int argc, char** argv) {
  Settings s;
  struct Number {
    double least, most;
    std::function<void(double)> set;
  };
  const std::map<std::string, Number> numbers = {
      {"dt", {1e-6, 1, [&](double v) { s.dt = v; }}},
      {"iterations", {1, 1e5, [&](double v) { s.iterations = int(v); }}},
      {"contacts", {1, 64, [&](double v) { s.contacts = int(v); }}},
      {"erp", {0, 1, [&](double v) { s.erp = v; }}},
      {"cfm", {0, 1e6, [&](double v) { s.cfm = v; }}},
      {"sor", {0.01, 2, [&](double v) { s.sor = v; }}},
      {"seed", {0, 1e9, [&](double v) { s.seed = static_cast<unsigned long>(v); }}},
      {"seconds", {0.01, 1e6, [&](double v) { s.seconds = v; }}}};
  const std::map<std::string, std::pair<std::string*, std::set<std::string>>> words = {
      {"reducer", {&s.reducer, {"first", "deepest", "spread"}}},
      {"solver", {&s.solver, {"quick", "step"}}},
      {"sleep", {&s.sleep, {"on", "off"}}}};
  for (int i = 1; i < argc; i += 2) {
    const std::string option = argv[i], name = option.rfind("--", 0) == 0 ? option.substr(2) : "";
    const auto number = numbers.find(name);
    const auto word = words.find(name);
    if (number == numbers.end() && word == words.end())
      throw std::invalid_argument("no such setting: " + option);
    if (i + 1 == argc) throw std::invalid_argument(option + " needs a value");
    const std::string text = argv[i + 1];
    if (word != words.end()) {
      if (!word->second.second.count(text))
        throw std::invalid_argument(option + ": unknown: " + text);
      *word->second.first = text;
      continue;
    }
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0') throw std::invalid_argument(option + ": no number: " + text);
    if (!(value >= number->second.least && value <= number->second.most))
      throw std::invalid_argument(option + ": out of range: " + text);
    number->second.set(value);
  }
  return s;
}

}  // namespace tradeoff

#endif
