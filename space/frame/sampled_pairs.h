// What was seen of the pairs that were picked from those of all frames.
#pragma once

#include <array>
#include <cstddef>

namespace ode_parallel_sap {

struct SampledPairs {
  // Pairs of which something would have left all out.
  struct Kind {
    // All; those that the narrow phase of the space collided; and of those, the ones with contacts.
    unsigned long long pairs = 0, collided = 0, touching = 0;
    // What the near callback took for them, if that was called pair by pair; and the sum of
    // squares.
    double report_ms = 0, report_ms_squared = 0;

    void add(const Kind& more) {
      pairs += more.pairs;
      collided += more.collided;
      touching += more.touching;
      report_ms += more.report_ms;
      report_ms_squared += more.report_ms_squared;
    }
  };
  // Pairs of two categories, the smaller number first, of which it is known whether they touch.
  struct Layers {
    unsigned long a = 0, b = 0;
    Kind seen;
  };

  Kind all, of_static, asleep, clear;             // clear of a plane
  unsigned long long untouched = 0;               // pairs of which it is known that they do not
  static constexpr std::size_t most_layers = 16;  // fixed: others are few pairs, or no layers
  std::array<Layers, most_layers> layers;
  std::size_t used_layers = 0;

  void addTo(unsigned long a, unsigned long b, const Kind& seen) {
    for (std::size_t i = 0; i < used_layers; ++i)
      if (layers[i].a == a && layers[i].b == b) return layers[i].seen.add(seen);
    if (used_layers < most_layers) layers[used_layers++] = {a, b, seen};
  }
  void add(const SampledPairs& more) {
    all.add(more.all);
    of_static.add(more.of_static);
    asleep.add(more.asleep);
    clear.add(more.clear);
    untouched += more.untouched;
    for (std::size_t i = 0; i < more.used_layers; ++i)
      addTo(more.layers[i].a, more.layers[i].b, more.layers[i].seen);
  }
};

}  // namespace ode_parallel_sap
