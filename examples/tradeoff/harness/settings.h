#ifndef TRADEOFF_HARNESS_SETTINGS_H
#define TRADEOFF_HARNESS_SETTINGS_H

#include <cstdlib>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>

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

namespace settings {

inline double number(const std::string& name, const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0')
    throw std::invalid_argument("--" + name + ": no number: " + text);
  return value;
}

inline double numberFrom(const std::string& name, const std::string& text, double least,
                         double most) {
  const double value = number(name, text);
  if (!(value >= least && value <= most))
    throw std::invalid_argument("--" + name + ": out of range: " + text);
  return value;
}

inline std::string oneOf(const std::string& name, const std::string& text,
                         std::initializer_list<const char*> words) {
  for (const char* word : words)
    if (text == word) return text;
  throw std::invalid_argument("--" + name + ": unknown: " + text);
}

}  // namespace settings

// Reads "--name value" pairs; throws std::invalid_argument where one is wrong.
inline Settings parseSettings(int argc, char** argv) {
  Settings s;
  using settings::numberFrom;
  using settings::oneOf;
  using Text = const std::string&;
  const std::map<std::string, std::function<void(Text, Text)>> readers = {
      {"dt", [&](Text n, Text v) { s.dt = numberFrom(n, v, 1e-6, 1); }},
      {"iterations", [&](Text n, Text v) { s.iterations = int(numberFrom(n, v, 1, 1e5)); }},
      {"contacts", [&](Text n, Text v) { s.contacts = int(numberFrom(n, v, 1, 64)); }},
      {"reducer",
       [&](Text n, Text v) {
         s.reducer = oneOf(n, v, {"first", "deepest", "spread"});
       }},
      {"erp", [&](Text n, Text v) { s.erp = numberFrom(n, v, 0, 1); }},
      {"cfm", [&](Text n, Text v) { s.cfm = numberFrom(n, v, 0, 1e6); }},
      {"sor", [&](Text n, Text v) { s.sor = numberFrom(n, v, 0.01, 2); }},
      {"solver",
       [&](Text n, Text v) {
         s.solver = oneOf(n, v, {"quick", "step"});
       }},
      {"sleep",
       [&](Text n, Text v) {
         s.sleep = oneOf(n, v, {"on", "off"});
       }},
      {"seed",
       [&](Text n, Text v) { s.seed = static_cast<unsigned long>(numberFrom(n, v, 0, 1e9)); }},
      {"seconds", [&](Text n, Text v) { s.seconds = numberFrom(n, v, 0.01, 1e6); }},
  };
  for (int i = 1; i < argc; i += 2) {
    const std::string word = argv[i];
    const auto reader = readers.find(word.size() > 2 ? word.substr(2) : "");
    if (word.rfind("--", 0) != 0 || reader == readers.end())
      throw std::invalid_argument("no such setting: " + word);
    if (i + 1 == argc) throw std::invalid_argument(word + " needs a value");
    reader->second(reader->first, argv[i + 1]);
  }
  return s;
}

}  // namespace tradeoff

#endif
