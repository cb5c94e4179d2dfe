// What a user lets a space leave out or add, or rely on.
#pragma once

#include <ode/ode.h>

namespace ode_parallel_sap {

struct PackRules {
  bool skip_static = false;  // no pairs of geoms without bodies
  bool skip_asleep = false;  // no pairs whose bodies are all disabled
  bool cull_planes = false;  // pairs of planes only with what reaches their half-space
  bool notified = false;     // what ODE does not tell a space of, the program does
  bool checked = false;      // whether it does is looked at in every frame
  dReal tolerance = 0;       // how far apart boxes of a pair may be

  // Whether pairs are left out by what geoms are, which may change unannounced.
  bool skip() const { return skip_static || skip_asleep; }
  // Whether every frame asks the geoms of all candidates for that.
  bool verified() const { return skip() && !notified; }

  bool operator==(const PackRules& other) const {
    return skip_static == other.skip_static && skip_asleep == other.skip_asleep &&
           cull_planes == other.cull_planes && notified == other.notified &&
           checked == other.checked && tolerance == other.tolerance;
  }
};

}  // namespace ode_parallel_sap
