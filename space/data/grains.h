// The work from which on threads are worth their start, stage by stage.
#ifndef ODE_PARALLEL_SAP_GRAINS_H
#define ODE_PARALLEL_SAP_GRAINS_H

#include "space/data/team.h"

namespace ode_parallel_sap {
namespace grains {

// A frame
constexpr Grain scene = {1024, Grain::every, 4096};         // slots
constexpr Grain scene_of_all_tests = {1024, Grain::whole};  // slots

// update
constexpr Grain packed_slots = {1024, Grain::further};
constexpr Grain counted_boxes = {4096, Grain::further};

// extract
constexpr Grain packed_cells = {256, Grain::whole};
constexpr Grain looked_at_words = {1024, Grain::whole};
constexpr Grain sorted_records = {16384, Grain::whole};
constexpr Grain box_tests = {1 << 18, Grain::further};
constexpr Grain sorted_members = {1000, Grain::whole};
constexpr Grain axis_pairs = {1 << 16, Grain::whole};

// coherence
constexpr Grain changed_boxes = {512, Grain::further};

// filter
constexpr Grain exact_tests = {16384, Grain::further};
constexpr Grain verified_pairs = {4096, Grain::further};
constexpr Grain half_space_tests = {8192, Grain::further};

// contacts
constexpr Grain listed_pairs = {8192, Grain::whole};
constexpr Grain collided_pairs = {256, Grain::whole};
constexpr Grain heavy_pairs = {4, Grain::whole};

// cuda
constexpr Grain sent_bytes = {3 << 17, Grain::whole};
constexpr Grain received_words = {1 << 15, Grain::whole};
constexpr Grain finished_pairs = {1 << 13, Grain::whole};

}  // namespace grains
}  // namespace ode_parallel_sap

#endif
