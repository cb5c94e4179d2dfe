#include "space/advice/advice.h"

#include <cstdio>
#include <utility>

#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

constexpr double least_share = 0.05;  // fixed: of the pairs; less is no advice

constexpr PackRules of_static = {true, false}, of_asleep = {false, true};

}  // namespace

void Advice::end(double pairs_ms, double frame_ms) {
  if (!space_) return;
  for (const std::string& line : lines(pairs_ms, frame_ms))
    dMessage(0, "parallel SAP space %p: %s", space_, line.c_str());
}

bool Advice::isDue() {
  const bool in_time = frames_++ % interval == 0, is_urgent = std::exchange(is_urgent_, false);
  if (in_time) urgent_ = 0;
  since_ = in_time || is_urgent ? 0 : since_ + 1;
  runs_ = true;
  if (since_ == 0) physics_.begin(frames_ - 1);
  return since_ == 0;
}

void Advice::endFrame(dxGeom* const* geoms, std::size_t slots, dReal swept) {
  if (!std::exchange(runs_, false)) return;
  if (since_ < 2)
    since_ == 0 ? physics_.lookFirst(geoms, slots, swept) : physics_.lookAgain(geoms, slots, swept);
  else
    is_urgent_ = urgent_ < most_urgent && physics_.glance(geoms, slots);
  urgent_ += is_urgent_;
}

void Advice::see(dGeomID a, dGeomID b) {
  const ScopedMode mode(exactMode());
  ++all_;
  const bool is_static = PairRule(of_static).isLeftOut(a, b);
  const bool sleeps = PairRule(of_asleep).isLeftOut(a, b);
  static_ += is_static;
  asleep_ += sleeps;
  if (!sleeps) physics_.see(a, b);
  clear_ += areClearByPlane(a, b);
}

void Advice::add(const Advice& other) {
  all_ += other.all_;
  static_ += other.static_;
  asleep_ += other.asleep_;
  clear_ += other.clear_;
  physics_.add(other.physics_);
}

std::vector<std::string> Advice::lines(double pairs_ms, double frame_ms) const {
  std::string line;
  const auto name = [&](unsigned long long pairs, const char* option, const char* which) {
    if (shareOf(pairs) < least_share) return;
    char text[256];
    std::snprintf(text, sizeof text,
                  "%s%s would leave out %.0f %% of the pairs (%s), at most %.2g of %.2g ms",
                  line.empty() ? "" : ", ", option, 100 * shareOf(pairs), which,
                  shareOf(pairs) * pairs_ms, frame_ms);
    line += text;
  };
  name(static_, "ODE_PARALLEL_SAP_SKIP_STATIC=1", "both geoms without a body");
  name(asleep_, "ODE_PARALLEL_SAP_SKIP_ASLEEP=1", "no body awake");
  name(clear_, "ODE_PARALLEL_SAP_CULL_PLANES=1", "a plane and a geom clear of it");
  std::vector<std::string> all = physics_.lines();
  if (!line.empty()) all.insert(all.begin(), line);
  return all;
}

}  // namespace ode_parallel_sap
