#ifndef PILE_RANDOM_H
#define PILE_RANDOM_H

#include <cstdint>
#include <random>

namespace pile {

// The same numbers on every system for one seed: the engine is fixed by the C++ standard, and the
// mapping to reals is done here because the standard leaves its distributions open.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // Uniform in [low, high).
  double uniform(double low, double high) {
    const double unit = static_cast<double>(engine_() >> 11) * 0x1p-53;
    return low + (high - low) * unit;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace pile

#endif
