// Picks pairs at random from those of all frames, to see of what kinds they are and how long the
// near callback takes for them.
#pragma once

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>

#include "space/data/pair_list.h"
#include "space/frame/geoms_ahead.h"
#include "space/frame/sampled_pairs.h"
#include "space/frame/stage_clock.h"

namespace ode_parallel_sap {

// Nothing is picked unless it is on. How many are depends on the time that frames take, so that the
// whole costs less than half a percent of it; which ones, on chance, so that frames that are alike
// do not show the same few pairs again and again.
class PairSample {
 public:
  // What the narrow phase of the space knows of a pair: how many contacts it has, or one of these.
  static constexpr int not_asked = -1;    // fixed: nobody asked it
  static constexpr int passed_over = -2;  // fixed: it was told to leave it, so nobody wants any

  explicit PairSample(bool on) : on_(on) {}

  bool on() const { return on_; }
  const SampledPairs& seen() const { return seen_; }

  // Calls use(place) for those that are picked of the next `count` pairs.
  template <class Use>
  void pick(std::size_t count, Use use) {
    if (!on_) return;
    std::size_t place = next_;
    for (; place < count; place += nextGap()) use(place);
    next_ = place - count;
  }

  // True, without picking, where none of the next `count` pairs is to be picked.
  bool passOver(std::size_t count) {
    if (next_ < count) return false;
    next_ -= count;
    return true;
  }

  // Calls call(pair) for all of them, in their order. contacts(place) is what is known of a
  // pair's contacts.
  template <class Call, class Contacts>
  void tell(const PairList& pairs, dxGeom* const* geoms, Call call, Contacts contacts) {
    const GeomsAhead ahead(geoms);
    if (!on_) {
      for (const Buffer<Pair>& part : pairs.parts) ahead.tell(part.begin(), part.end(), call);
      return;
    }
    std::size_t first = 0;
    for (const Buffer<Pair>& part : pairs.parts) {
      const Pair* next = part.data();
      const auto tellUntil = [&](const Pair* end) {
        ahead.tell(next, end, call);
        next = end;
      };
      pick(part.size(), [&](std::size_t place) {
        tellUntil(part.data() + place);
        const Pair pair = *next++;
        time(geoms[earlierOf(pair)], geoms[laterOf(pair)], contacts(first + place),
             [&] { call(pair); });
      });
      tellUntil(part.data() + part.size());
      first += part.size();
    }
  }

  // A picked pair: calls `call` and takes the time.
  template <class Call>
  void time(const dxGeom* a, const dxGeom* b, int contacts, Call call) {
    const Kinds kinds = kindsOf(a, b);
    const Clock::time_point before = Clock::now(), begin = Clock::now();
    call();
    const Clock::time_point end = Clock::now();
    add(kinds, contacts, milliseconds(begin, end) - milliseconds(before, begin));
  }
  // One that nobody calls back for.
  void see(const dxGeom* a, const dxGeom* b, int contacts) { add(kindsOf(a, b), contacts, 0); }

  // A frame with so many pairs took so long.
  void endFrame(unsigned long long pairs, double ms);

 private:
  struct Kinds {
    bool of_static, asleep, clear;
    unsigned long a, b;  // their categories
  };
  static Kinds kindsOf(const dxGeom* a, const dxGeom* b);
  void add(const Kinds& kinds, int contacts, double ms);
  double withoutOutliers(double ms) const;
  std::size_t nextGap();

  bool on_;
  std::size_t next_ = 0;  // pairs before the next that is picked
  double one_in_ = 256;   // pairs, on average; until a frame has told what it takes
  std::uint32_t random_ = 2463534242;
  double pairs_ = 0, ms_ = 0;  // of all frames
  double due_ms_ = 0;          // of all frames, when the next pick will be due
  SampledPairs seen_;
};

}  // namespace ode_parallel_sap
