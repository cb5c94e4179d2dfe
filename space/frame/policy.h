// All that is decided about a frame, and what was learnt from those before it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "space/base/back_off.h"
#include "space/contacts/certainly_apart.h"
#include "space/frame/device_choice.h"
#include "space/frame/plan.h"
#include "space/frame/settings.h"
#include "space/frame/team_choice.h"

namespace ode_parallel_sap {

// Work of a size that slots do not tell, and what it took.
struct Batch {
  enum Of { contacts, blocks, rays, kinds };

  Of of;
  int threads;        // that worked
  std::size_t items;  // pairs in a narrow phase, pairs handed out in blocks, rays
  double ms;
};

// What a frame took whose pairs were found anew.
struct FoundAnew {
  bool wide;  // the boxes were doubles
  int devices, threads;
  std::size_t candidates;
  double found_ms, extract_ms;
};

// Pairs and their order depend on none of its decisions, which may depend on what frames took.
class Policy {
 public:
  // Whether a scene is so small that it is collided on the spot (small_scenes.h).
  static bool isSmall(std::size_t slots, const Settings& settings);

  Plan decide(const SceneFacts& facts, const Settings& settings) const;
  // The threads for anything that looks at so many slots.
  int teamFor(std::size_t slots, const Settings& settings) const;
  int threadsForRays(std::size_t rays, const Settings& settings) const;

  // A frame went by `plan` at least until its pairs were found.
  void learn(const Plan& plan, std::size_t slots, const Settings& settings, const FoundAnew& frame);
  void learnOfKept();  // pairs
  // What a batch took.
  void learnOfBatch(const Settings& settings, const Batch& batch);
  // What was tested whether it is apart, and what is.
  void learnOfApart(const Plan& plan, const ApartCounts& boxes);
  // Devices failed: so many are left.
  void learnOfLoss(int devices_left) { device_choice_.lost(devices_left); }
  // How many devices should be made ready.
  int learnMissedDevices(const Plan& plan, const SceneFacts& facts, const Settings& settings);

 private:
  static int mostThreads(std::size_t slots, const Settings& settings);
  static int chosen(const TeamChoice& team, const Settings& settings, int most);
  static int methodFor(const SceneFacts& facts, const Settings& settings);
  void planDevices(const SceneFacts& facts, const Settings& settings, Plan& plan) const;

  TeamChoice team_, batch_teams_[Batch::kinds];
  DeviceChoice device_choice_;
  // To test boxes that touch costs a little each.
  BackOff apart_{4};
};

}  // namespace ode_parallel_sap
