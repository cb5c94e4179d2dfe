// The overlaps that a batch of probes owes: a loop over dSpaceCollide2 and dCollide.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "configurations.h"
#include "contact_scene.h"
#include "ray_oracle.h"

namespace sap_test {

using Probes = std::vector<dParallelSAPProbe>;

// Of each probe, what the callback gets, and what is written to `touched` with a callback, without
// one, and where the first overlap will do.
struct OverlapAnswers {
  std::vector<Contacts> contacts;
  std::vector<std::size_t> touched, counted, any;
};
OverlapAnswers owedOverlaps(dSpaceID space, const Probes& probes, int flags,
                            const Filter& filter = nullptr);

// Bit for bit: "" or where they differ.
std::string difference(const OverlapAnswers& got, const OverlapAnswers& owed);

// The other kind of query beside RayBatch: probes in no space or in another one.
struct ProbeBatch {
  Probes probes;
  Random& random;
  const Space other = Space();

  ProbeBatch(std::size_t n, Random& random);
  ~ProbeBatch();
  ProbeBatch(const ProbeBatch&) = delete;
  ProbeBatch& operator=(const ProbeBatch&) = delete;

  // Each at one of the geoms.
  void moveTo(const std::vector<dGeomID>& geoms);
  int someFlags() { return static_cast<int>(random.below(9)); }
  OverlapAnswers ask(dSpaceID space, int flags) const;
  OverlapAnswers owed(dSpaceID space, const std::vector<dGeomID>&, int flags,
                      const Filter& filter = nullptr) const {
    return owedOverlaps(space, probes, flags, filter);
  }
  static std::size_t meeting(const OverlapAnswers& answers);
  void report(dSpaceID space, int flags, const std::function<void(dGeomID)>& callback) const;
  Bounds bounds(std::size_t query) const { return boundsOf(probes.at(query).geom); }

 private:
  Probes own_;  // to destroy
};

}  // namespace sap_test
