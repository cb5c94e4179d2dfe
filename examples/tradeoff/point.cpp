// A scene of the study's own, run once: tradeoff-point NAME BODIES [--SETTING VALUE...]
#include <cstdio>
#include <cstdlib>

#include "scenes.h"

int main(int argc, char** argv) {
  try {
    if (argc < 3) throw std::invalid_argument("which scene, and of how many bodies?");
    const tradeoff::Scene scene = tradeoff::sceneNamed(argv[1], std::max(1, std::atoi(argv[2])));
    return tradeoff::run(argc - 2, argv + 2, scene);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}
