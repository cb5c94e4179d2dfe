#!/usr/bin/env bash
# Do FCL's collision managers report the same pairs if boxes are registered one by one as if they are registered at once?
# Expected: the same; at most managers differ about boxes that just touch.
# Seen: registered one by one, SaPCollisionManager misses pairs in a third of random scenes, among them boxes of 1 m that
# overlap by 0.8 m on every axis. Registered at once it misses none there. Of touching boxes it, and the interval tree, miss a
# third either way.
. "$(dirname "$0")/packages.sh"
packages libfcl0.7=0.7.0-3+b1 libfcl-dev=0.7.0-3+b1 libccd2=2.1-2+b1 libccd-dev=2.1-2+b1 liboctomap1.9=1.9.7+dfsg-3+b1 \
  liboctomap-dev=1.9.7+dfsg-3+b1 libeigen3-dev=3.4.0-4
program -I"$room/usr/include/eigen3" -lfcl -lccd -loctomap -loctomath <<'END'
#include <fcl/fcl.h>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <set>
#include <vector>

using Object = fcl::CollisionObjectd;
using Pairs = std::set<std::pair<Object*, Object*>>;

static bool note(Object* a, Object* b, void* pairs) {
  static_cast<Pairs*>(pairs)->insert({std::min(a, b), std::max(a, b)});
  return false;
}

// What a manager misses of the pairs of all scenes.
struct Tally {
  int scenes = 0, pairs = 0;
  double deepest = 0;
};

template <class Manager>
static Pairs pairs(const std::vector<Object*>& objects, bool at_once) {
  Manager manager;
  if (at_once) manager.registerObjects(objects);
  else
    for (Object* object : objects) manager.registerObject(object);
  manager.setup();
  Pairs result;
  manager.collide(&result, note);
  return result;
}

static void compare(Tally& tally, const Pairs& all, const Pairs& found) {
  Tally here;
  for (const auto& [a, b] : all)
    if (found.count({a, b}) == 0)
      ++here.pairs, here.deepest = std::max(here.deepest, 1 - (a->getTranslation() - b->getTranslation()).cwiseAbs().maxCoeff());
  tally.scenes += here.pairs > 0, tally.pairs += here.pairs, tally.deepest = std::max(tally.deepest, here.deepest);
}

int main() {
  const auto box = std::make_shared<fcl::Boxd>(1, 1, 1);
  for (const bool lattice : {false, true})
    for (const bool at_once : {false, true}) {
      Tally tree, sap, intervals;
      const int scenes = lattice ? 1 : 100;
      for (int seed = 1; seed <= scenes; ++seed) {
        std::srand(seed);
        const auto random = [] { return 7 * (std::rand() / (double)RAND_MAX); };
        std::vector<std::unique_ptr<Object>> owned;
        std::vector<Object*> objects;
        for (int i = 0; i < 512; ++i) {
          const double x = random(), y = random(), z = random();
          const fcl::Vector3d place = lattice ? fcl::Vector3d(i % 8, i / 8 % 8, i / 64) : fcl::Vector3d(x, y, z);
          owned.emplace_back(new Object(box, fcl::Matrix3d::Identity(), place));
          objects.push_back(owned.back().get());
        }
        const Pairs all = pairs<fcl::NaiveCollisionManagerd>(objects, at_once);
        compare(tree, all, pairs<fcl::DynamicAABBTreeCollisionManagerd>(objects, at_once));
        compare(sap, all, pairs<fcl::SaPCollisionManagerd>(objects, at_once));
        compare(intervals, all, pairs<fcl::IntervalTreeCollisionManagerd>(objects, at_once));
      }
      std::printf("%s, registered %s:\n", lattice ? "touching lattice" : "100 random scenes", at_once ? "at once" : "one by one");
      const auto say = [](const char* name, const Tally& tally) {
        std::printf("  %s misses %d pairs in %d scenes, deepest %.1f m\n", name, tally.pairs, tally.scenes, tally.deepest);
      };
      say("tree", tree), say("SaP", sap), say("interval tree", intervals);
    }
}
END
shows <<'END'
100 random scenes, registered one by one:
  tree misses 0 pairs in 0 scenes, deepest 0.0 m
  SaP misses 41 pairs in 31 scenes, deepest 0.8 m
  interval tree misses 0 pairs in 0 scenes, deepest 0.0 m
100 random scenes, registered at once:
  tree misses 0 pairs in 0 scenes, deepest 0.0 m
  SaP misses 0 pairs in 0 scenes, deepest 0.0 m
  interval tree misses 0 pairs in 0 scenes, deepest 0.0 m
touching lattice, registered one by one:
  tree misses 0 pairs in 0 scenes, deepest 0.0 m
  SaP misses 1477 pairs in 1 scenes, deepest 0.0 m
  interval tree misses 1638 pairs in 1 scenes, deepest 0.0 m
touching lattice, registered at once:
  tree misses 0 pairs in 0 scenes, deepest 0.0 m
  SaP misses 1638 pairs in 1 scenes, deepest 0.0 m
  interval tree misses 1638 pairs in 1 scenes, deepest 0.0 m
END
