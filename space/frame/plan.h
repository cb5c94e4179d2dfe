// What a frame is to do: decided once, when it begins, and not changed after.
#pragma once

#include <cstddef>

#include "space/finders/extraction.h"
#include "space/frame/device_choice.h"
#include "space/geoms/pack_rules.h"

namespace ode_parallel_sap {

// What is known when a frame begins.
struct SceneFacts {
  std::size_t slots;
  bool last_wide;  // its boxes were doubles
  bool nested;     // within a callback of this space
  DeviceBackend::Devices devices;
  bool for_contacts = false;                       // the narrow phase follows
  bool for_blocks = false;                         // a report in blocks on all threads follows
  UserClassSet tested_classes = all_user_classes;  // whose AABBTest may say no
};

struct Plan {
  PackRules rules;          // those that the user set
  int threads = 1;          // of all stages up to the report
  int contact_threads = 1;  // of the narrow phase
  int block_threads = 1;    // of a report in blocks on all threads
  bool leave_out = false;   // boxes that are certainly apart are not collided
  bool fat_pairs = false;   // kept pairs of larger boxes may serve, if those hold the boxes
  bool keep = false;        // boxes and pairs of the last frame serve where little has changed
  ExtractionPlan extraction;
  // Where extraction may run on devices: what was weighed, and how it came out.
  bool weighs_devices = false;
  DeviceChoice::Candidates candidates;
  DeviceChoice::Decision device_decision;
};

}  // namespace ode_parallel_sap
