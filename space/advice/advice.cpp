#include "space/advice/advice.h"

#include <cstdio>

#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

constexpr double least_share = 0.05;  // fixed: of the pairs; less is no advice

constexpr PackRules of_static = {true, false}, of_asleep = {false, true};

}  // namespace

void Advice::end(double pairs_ms, double frame_ms) {
  const std::string said = space_ ? line(pairs_ms, frame_ms) : "";
  if (!said.empty()) dMessage(0, "parallel SAP space %p: %s", space_, said.c_str());
}

bool Advice::isDue() {
  return frames_++ % interval == 0;
}

void Advice::see(dGeomID a, dGeomID b) {
  const ScopedMode mode(exactMode());
  ++all_;
  static_ += PairRule(of_static).isLeftOut(a, b);
  asleep_ += PairRule(of_asleep).isLeftOut(a, b);
  clear_ += areClearByPlane(a, b);
}

void Advice::add(const Advice& other) {
  all_ += other.all_;
  static_ += other.static_;
  asleep_ += other.asleep_;
  clear_ += other.clear_;
}

std::string Advice::line(double pairs_ms, double frame_ms) const {
  std::string all;
  const auto name = [&](unsigned long long pairs, const char* option, const char* which) {
    if (shareOf(pairs) < least_share) return;
    char text[256];
    std::snprintf(text, sizeof text,
                  "%s%s would leave out %.0f %% of the pairs (%s), at most %.2g of %.2g ms",
                  all.empty() ? "" : ", ", option, 100 * shareOf(pairs), which,
                  shareOf(pairs) * pairs_ms, frame_ms);
    all += text;
  };
  name(static_, "ODE_PARALLEL_SAP_SKIP_STATIC=1", "both geoms without a body");
  name(asleep_, "ODE_PARALLEL_SAP_SKIP_ASLEEP=1", "no body awake");
  name(clear_, "ODE_PARALLEL_SAP_CULL_PLANES=1", "a plane and a geom clear of it");
  return all;
}

}  // namespace ode_parallel_sap
