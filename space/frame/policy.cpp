#include "space/frame/policy.h"

#include <algorithm>

#include "space/base/mechanisms.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

bool isAuto(const Settings& settings) {
  return settings.method == dParallelSAPMethodAuto;
}

// The most threads that are worth their start for a batch of so many.
int mostThreadsFor(Batch::Of of, std::size_t items, const Settings& settings) {
  static constexpr Grain grain_of[Batch::kinds] = {grains::collided_pairs, grains::handed_out_pairs,
                                                   grains::cast_rays};
  return teamFor(items, grain_of[of], threadsFor(settings));
}

// The processor may be chosen, too.
bool mayTakeProcessor(const Settings& settings) {
  return settings.backend == dParallelSAPBackendAuto;
}

// Those of `devices` that the user allows.
DeviceChoice::Candidates candidatesOf(const Settings& settings, int devices) {
  const bool processor = mayTakeProcessor(settings);
  return settings.devices == 0
             ? DeviceChoice::Candidates::upTo(processor, devices)
             : DeviceChoice::Candidates::only(processor, std::min(settings.devices, devices));
}

}  // namespace

bool Policy::isSmall(std::size_t slots, const Settings& settings) {
  return mechanisms::small_scenes && slots <= small_scene_slots &&
         (isAuto(settings) || settings.method == dParallelSAPMethodBruteForce) &&
         settings.backend != dParallelSAPBackendCUDA;
}

// The most threads that are worth their start for this number of slots.
int Policy::mostThreads(std::size_t slots, const Settings& settings) {
  const bool tests_all = settings.method == dParallelSAPMethodBruteForce ||
                         settings.method == dParallelSAPMethodAxisLists;
  return ode_parallel_sap::teamFor(slots, tests_all ? grains::scene_of_all_tests : grains::scene,
                                   threadsFor(settings));
}

// A number that the user set is taken as it is.
int Policy::chosen(const TeamChoice& team, const Settings& settings, int most) {
  return settings.threads == 0 ? team.threads(most) : most;
}

int Policy::teamFor(std::size_t slots, const Settings& settings) const {
  return chosen(team_, settings, mostThreads(slots, settings));
}

int Policy::threadsForRays(std::size_t rays, const Settings& settings) const {
  return chosen(batch_teams_[Batch::rays], settings, mostThreadsFor(Batch::rays, rays, settings));
}

Plan Policy::decide(const SceneFacts& facts, const Settings& settings) const {
  Plan plan;
  plan.rules = settings.rules;
  plan.rules.tested_classes = facts.tested_classes;
  plan.threads = teamFor(facts.slots, settings);
  // A team as large as that of the narrow phase or the report: some OpenMP runtimes end the threads
  // that a smaller one does without, and start new ones for the next large one.
  const int threads = threadsFor(settings);
  if (facts.team_follows && plan.threads > 1) plan.threads = threads;
  plan.contact_threads = chosen(batch_teams_[Batch::contacts], settings, threads);
  plan.block_threads = chosen(batch_teams_[Batch::blocks], settings, threads);
  const bool by_what_pays = settings.apart == Settings::by_what_pays;
  plan.leave_apart_out = by_what_pays ? !apart_.waits() : settings.apart != 0;
  // Where method and back end were left to the space, or to the sweep on the CPU. Not within a
  // callback, which has the pairs.
  plan.use_cache = mechanisms::kept_pairs && !facts.nested &&
                   settings.backend != dParallelSAPBackendCUDA &&
                   (isAuto(settings) || settings.method == dParallelSAPMethodSweep);
  ExtractionPlan& extraction = plan.extraction;
  extraction.method = settings.method;
  if (isAuto(settings))
    extraction.method =
        settings.backend == dParallelSAPBackendCUDA || facts.slots > brute_force_slots
            ? dParallelSAPMethodSweep
            : dParallelSAPMethodBruteForce;
  extraction.threads = plan.threads;
  extraction.axis_lists_bytes = settings.axis_lists_bytes;
  // Times must not decide which extra pairs a tolerance lets through.
  const bool only_cpu = mayTakeProcessor(settings) && settings.rules.tolerance > 0;
  if (facts.devices.any && settings.backend != dParallelSAPBackendCPU && !only_cpu)
    planDevices(facts, settings, plan);
  plan.fat_pairs = mechanisms::fat_pairs && plan.use_cache && extraction.devices == 0 &&
                   (extraction.method == dParallelSAPMethodSweep || settings.rules.tolerance > 0);
  return plan;
}

// A number that is set without leave for the processor is taken as it is. Where the processor may
// be chosen, devices are chosen only once they are ready, so that no frame waits for them.
void Policy::planDevices(const SceneFacts& facts, const Settings& settings, Plan& plan) const {
  ExtractionPlan& extraction = plan.extraction;
  const bool processor = mayTakeProcessor(settings);
  if (extraction.method == dParallelSAPMethodAxisLists) {
    if (processor) return;
    extraction.devices = std::max(1, settings.devices);
    // One thread drives each device, in small scenes too.
    extraction.threads = std::max(plan.threads, std::min(extraction.devices, threadsFor(settings)));
    return;
  }
  if (extraction.method != dParallelSAPMethodSweep) return;
  if (!processor && settings.devices > 0) {
    extraction.devices = settings.devices;
    return;
  }
  if (processor && facts.last_wide) return;
  int ready = processor ? facts.devices.ready : std::max(facts.devices.ready, 1);
  if (ready < std::min(settings.devices, facts.devices.usable)) ready = 0;
  plan.weighs_devices = true;
  plan.device_decision = device_choice_.decide(facts.slots, candidatesOf(settings, ready));
  extraction.devices = plan.device_decision.devices;
}

void Policy::learn(const Plan& plan, const SceneFacts& facts, const Settings& settings,
                   const Found& found, const FrameTimes& times) {
  if (settings.threads == 0 && mostThreads(facts.slots, settings) > 1)
    team_.learn(found.threads, facts.slots, times.found_ms, team_times.stalled());
  if (plan.weighs_devices && !facts.last_wide)
    device_choice_.learn(plan.device_decision, std::min(found.devices, DeviceChoice::most_devices),
                         facts.slots, found.pairs, times.extract_ms);
}

void Policy::learnOfBatch(const Settings& settings, const Batch& batch) {
  if (settings.threads == 0 && mostThreadsFor(batch.of, batch.items, settings) > 1)
    batch_teams_[batch.of].learn(batch.threads, batch.items, batch.ms, team_times.stalled());
}

// Counts decide, not times. In instructions (callgrind, AVX2) the test of two boxes takes 165 and
// saves 460 of dCollide's where they are apart.
void Policy::learnOfApart(const Plan& plan, const ApartCounts& boxes) {
  if (!plan.leave_apart_out)
    apart_.pass();
  else if (static_cast<double>(boxes.apart) < least_apart_boxes * static_cast<double>(boxes.tested))
    apart_.failed();
  else if (boxes.tested > 0)
    apart_.paid();
}

int Policy::learnMissedDevices(const SceneFacts& facts, const Settings& settings) {
  return device_choice_.learnMissed(facts.slots, candidatesOf(settings, facts.devices.usable),
                                    facts.devices.ready);
}

}  // namespace ode_parallel_sap
