// A small random number generator with the same sequence on every machine (the distributions of
// the standard library differ between implementations).
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace sap_test {

// SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  // In [0, n); n must be positive.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(bits() % n); }

  bool chance(double probability) { return unit() < probability; }

  // In [0, 1).
  double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  double between(double low, double high) { return low + (high - low) * unit(); }

  double gauss() {
    const double radius = std::sqrt(-2 * std::log(1 - unit()));
    return radius * std::cos(6.283185307179586 * unit());
  }

 private:
  std::uint64_t state_;
};

template <typename T>
void shuffle(T* items, std::size_t count, Random& random) {
  for (std::size_t i = count; i > 1; --i) std::swap(items[i - 1], items[random.below(i)]);
}

}  // namespace sap_test
