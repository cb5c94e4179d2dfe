#include "space/frame/policy.h"

#include "space/base/mechanisms.h"

namespace ode_parallel_sap {

int Policy::teamFor(std::size_t slots, const Settings& settings) {
  if (slots <= small_scene_slots && !teamsAreTested()) return 1;  // without asking OpenMP
  const bool tests_all = settings.method == dParallelSAPMethodBruteForce ||
                         settings.method == dParallelSAPMethodAxisLists;
  return ode_parallel_sap::teamFor(slots, tests_all ? grains::items : grains::scene,
                                   threadsFor(settings));
}

Plan Policy::decide(const SceneFacts& facts, const Settings& settings) const {
  const bool is_auto = settings.method == dParallelSAPMethodAuto;
  Plan plan;
  plan.rules = settings.rules;
  plan.threads = teamFor(facts.slots, settings);
  plan.most_threads = threadsFor(settings);
  // Where method and back end were left to the space, or to the sweep on the CPU. Not within a
  // callback, which has the pairs.
  plan.use_cache = mechanisms::kept_pairs && !facts.nested &&
                   settings.backend != dParallelSAPBackendCUDA &&
                   (is_auto || settings.method == dParallelSAPMethodSweep);
  ExtractionPlan& extraction = plan.extraction;
  extraction.method = settings.method;
  if (is_auto) {
    const bool crowded = facts.last_pairs > facts.slots * facts.slots / crowded_share;
    const std::size_t most = crowded ? crowded_slots : brute_force_slots;
    extraction.method = settings.backend == dParallelSAPBackendCUDA || facts.slots > most
                            ? dParallelSAPMethodSweep
                            : dParallelSAPMethodBruteForce;
  }
  extraction.threads = plan.threads;
  // Times must not decide which extra pairs a tolerance lets through.
  const bool only_cpu = settings.backend == dParallelSAPBackendAuto && settings.rules.tolerance > 0;
  if (facts.devices.any && settings.backend != dParallelSAPBackendCPU && !only_cpu)
    planDevices(facts, settings, plan);
  // In crowded scenes, too: extra pairs within a later tolerance are to be those of the sweep.
  plan.fat_pairs = mechanisms::fat_pairs && plan.use_cache && extraction.devices == 0 &&
                   (facts.slots > brute_force_slots ||
                    extraction.method == dParallelSAPMethodSweep || settings.rules.tolerance > 0);
  return plan;
}

// With CUDA set, a number of devices that is set is used as it is. With Auto, devices are chosen
// only once they are ready, so that no frame waits for them.
void Policy::planDevices(const SceneFacts& facts, const Settings& settings, Plan& plan) const {
  ExtractionPlan& extraction = plan.extraction;
  const bool processor = settings.backend == dParallelSAPBackendAuto;  // may be chosen, too
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
  plan.device_decision = device_choice_.decide(facts.slots, {processor, ready, settings.devices});
  extraction.devices = plan.device_decision.devices;
}

int Policy::learn(const Plan& plan, const SceneFacts& facts, const Settings& settings,
                  const dParallelSAPStats* found) {
  if (found && !facts.last_wide)
    device_choice_.learn(plan.device_decision, std::min(found->devices, DeviceChoice::most_devices),
                         facts.slots, found->candidates, found->extract_ms);
  device_choice_.lost(facts.devices.usable);
  const bool processor = settings.backend == dParallelSAPBackendAuto;
  return device_choice_.learnMissed(
      facts.slots, {processor, facts.devices.usable, settings.devices}, facts.devices.ready);
}

}  // namespace ode_parallel_sap
