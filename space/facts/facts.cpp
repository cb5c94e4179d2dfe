#include "space/facts/facts.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <new>
#include <unordered_set>

#include "space/base/platform.h"
#include "space/geoms/geom_sides.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

constexpr double least_share = 0.05;  // fixed: of the pairs, or of a frame's time; less is not said
constexpr double most_moved = 0.5;    // sides; as in dParallelSAPSpaceIsFast
constexpr double most_coarse = 1.0 / 512;  // sides; fixed: a contact is rarely deeper

constexpr PairRules of_static = {true, false}, of_asleep = {false, true};

bool isStill(dBodyID body, dReal speed, dReal turn) {
  return dCalcVectorLength3(dBodyGetLinearVel(body)) <= speed &&
         dCalcVectorLength3(dBodyGetAngularVel(body)) <= turn;
}

// Whether a body would sleep but for a still kinematic one: ODE wakes what touches an enabled body.
bool isKeptAwake(dBodyID body, dBodyID other) {
  return body && other && dBodyIsKinematic(other) && dBodyIsEnabled(other) &&
         !dBodyGetAutoDisableFlag(other) && isStill(other, 0, 0) && !dBodyIsKinematic(body) &&
         dBodyGetAutoDisableFlag(body) &&
         isStill(body, dBodyGetAutoDisableLinearThreshold(body),
                 dBodyGetAutoDisableAngularThreshold(body));
}

// Those that are to be printed. They may outlive all else.
struct Printing {
  std::mutex mutex;
  std::unordered_set<const PrintedFacts*> facts;
  long process = 0;
};
Printing& printing() {
  static Printing& all = *new Printing;
  return all;
}

// Of the corners with all lower and all upper bounds, the one that moved farther.
double lengthOf(const LastGeom::Box& motion) {
  double squares[2] = {0, 0};
  for (std::size_t i = 0; i < 6; ++i)
    squares[i % 2] += static_cast<double>(motion[i]) * static_cast<double>(motion[i]);
  return std::sqrt(std::max(squares[0], squares[1]));
}

// Whether its body's velocity led it this way, as no teleport does but by chance.
bool isLed(const dxGeom* geom, const dReal* way) {
  if (!geom->body) return false;
  const dReal* const velocity = dBodyGetLinearVel(geom->body);
  return dCalcVectorDot3(velocity, way) >
         dReal(0.99) * dCalcVectorLength3(velocity) * dCalcVectorLength3(way);
}

}  // namespace

void Facts::see(dGeomID a, dGeomID b) {
  const ScopedMode mode(exactMode());
  ++counts_[pairs];
  counts_[of_statics] += of_static.isLeftOut(a, b);
  counts_[of_sleepers] += of_asleep.isLeftOut(a, b);
  counts_[clear] += areClearByPlane(a, b);
  counts_[kept_awake] += isKeptAwake(a->body, b->body) || isKeptAwake(b->body, a->body);
}

void Facts::endFrame(dxSpace* space, bool any_moved) try {
  ++counts_[frames];
  facts_[fast].now = facts_[swept].now = 0;
  if (any_moved) {
    const ScopedMode mode(exactMode());
    facts_[far_away].now = facts_[invalid].now = 0;
    ++moving_frame_;
    seeSpace(space, !parallelSAPSpace(space)->settings().rules.skip_static);
  }
  all_stood_ = !any_moved;
  for (Fact& fact : facts_) {
    fact.frames += fact.now > 0;
    fact.most = std::max(fact.most, fact.now);
  }
} catch (const std::bad_alloc&) {  // then it begins anew
  last_.clear();
}

void Facts::seeSpace(dxSpace* space, bool of_space) {
  const ParallelSAPSpace* const own = parallelSAPSpace(space);
  for (dxGeom* geom = space->first; geom; geom = geom->next) {
    counts_[geoms] += of_space;
    // What a callback moved or put there is new in the next frame.
    if (geom->gflags & GEOM_DIRTY || !isEnabled(geom) || geom->type == dRayClass) continue;
    if (IS_SPACE(geom))
      seeSpace(static_cast<dxSpace*>(geom), false);
    else if (hasNaN(geom))
      note(invalid, geom, 0);
    else if (isPlain(geom))
      counts_[statics] += seeGeom(geom, own ? own->sweptBounds() : 0) && of_space && !geom->body;
  }
}

// Whether it has stood still, as far as that is known.
bool Facts::seeGeom(dxGeom* geom, dReal step) {
  LastGeom& now = last_[geom];
  const LastGeom before = now;
  const bool is_new = before.moving_frame + 1 != moving_frame_;
  now.moving_frame = moving_frame_;
  now.motion = {};
  std::copy_n(geom->aabb, 6, now.box.begin());
  if (geom->final_posr) std::copy_n(dGeomGetPosition(geom), 3, now.place);
  const bool is_still = is_new || now.box == before.box;
  if (is_new || !is_still) {
    const double side = static_cast<double>(smallestSide(geom));
    if (!(side > 0)) return is_still;
    dReal farthest = 0;
    for (const dReal bound : now.box) farthest = std::max(farthest, std::fabs(bound));
    now.coarse = static_cast<double>(farthest * std::numeric_limits<dReal>::epsilon()) / side;
    if (!is_new) seeMotion(geom, before, step, side, now);
  }
  if (now.coarse > most_coarse) note(far_away, geom, now.coarse);
  return is_still;
}

// Notes a motion on which the geom may pass through others. What is put elsewhere passes nothing:
// a geom that its body's velocity does not lead moves twice in a row and the same way.
void Facts::seeMotion(const dxGeom* geom, const LastGeom& before, dReal step, double side,
                      LastGeom& now) {
  dVector3 way;
  dSubtractVectors3(way, now.place, before.place);
  const double length = static_cast<double>(dCalcVectorLength3(way)) / side;
  dReal along = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    now.motion[i] = now.box[i] - before.box[i];
    along += now.motion[i] * before.motion[i];
  }
  const double least = std::min(lengthOf(now.motion), lengthOf(before.motion)) / side;
  if (length > most_moved && isLed(geom, way)) {
    const dReal covered = dCalcVectorLength3(dBodyGetLinearVel(geom->body)) * step;
    note(static_cast<double>(covered) < 0.99 * length * side ? fast : swept, geom, length);
  } else if (!(geom->body && step > 0) && !all_stood_ && along > 0 && least > most_moved) {
    note(fast, geom, least);
  }
}

void Facts::note(Kind kind, const dxGeom* geom, double measure) {
  Fact& fact = facts_[kind];
  ++fact.now;
  if (fact.geom && !(measure > fact.worst)) return;
  fact.worst = measure;
  fact.geom = geom;
}

void Facts::add(const Facts& other) {
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    Fact& fact = facts_[kind];
    const Fact& more = other.facts_[kind];
    fact.most = std::max(fact.most, more.most);
    fact.frames += more.frames;
    if (!more.geom || (fact.geom && !(more.worst > fact.worst))) continue;
    fact.worst = more.worst;
    fact.geom = more.geom;
  }
  for (std::size_t i = 0; i < counts; ++i) counts_[i] += other.counts_[i];
}

std::vector<std::string> Facts::lines(const FrameSums& frame) const {
  constexpr const char* texts[kinds] = {
      "moved by more than half of their smallest side between frames and may pass through others; "
      "the worst moved %.3g sides",
      "moved by more than half of their smallest side between frames, which swept bounds cover; "
      "the worst moved %.3g sides",
      "are so far from the origin that a step of dReal is more than 1/512 of their smallest side; "
      "at the worst %.2g sides",
      "had NaN bounds and were in no pair"};
  std::vector<std::string> all;
  char text[512];
  const auto print = [&text](const char* format, auto... values) -> std::string {
    std::snprintf(text, sizeof text, format, values...);
    return text;
  };
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    const Fact& fact = facts_[kind];
    if (fact.most == 0) continue;
    all.push_back(
        print("up to %zu geoms at once ", fact.most) + print(texts[kind], fact.worst) +
        print(" (geom %p); in %llu of %llu frames", fact.geom, fact.frames, counts_[frames]));
  }
  const auto shareOf = [this](Count part, Count whole) {
    const auto count = [this](Count of) { return static_cast<double>(counts_[of]); };
    return counts_[whole] ? count(part) / count(whole) : 0;
  };
  if (const double share = shareOf(kept_awake, pairs); share >= least_share)
    all.push_back(print(
        "%.0f %% of the pairs have a body at rest that an enabled kinematic body keeps awake, so "
        "ODE_PARALLEL_SAP_SKIP_ASLEEP=1 leaves none of them out",
        100 * share));
  std::string options;
  const auto name = [&](double share, double ms, const char* option, const char* of,
                        const char* which) {
    if (share < least_share) return;
    if (!options.empty()) options += ", ";
    options += print("%s would leave out %.0f %% of the %s (%s), at most %.2g of %.2g ms", option,
                     100 * share, of, which, share * ms, frame.total_ms);
  };
  const double pairs_ms = frame.extract_ms + frame.filter_ms + frame.narrow_ms + frame.report_ms;
  const auto namePairs = [&](Count part, const char* option, const char* which) {
    name(shareOf(part, pairs), pairs_ms, option, "pairs", which);
  };
  namePairs(of_statics, "ODE_PARALLEL_SAP_SKIP_STATIC=1", "both geoms without a body");
  namePairs(of_sleepers, "ODE_PARALLEL_SAP_SKIP_ASLEEP=1", "no body awake");
  namePairs(clear, "ODE_PARALLEL_SAP_CULL_PLANES=1", "a plane and a geom clear of it");
  if (const double share = shareOf(statics, geoms);
      share * frame.update_ms >= least_share * frame.total_ms)
    name(share, frame.update_ms, "ODE_PARALLEL_SAP_SKIP_STATIC=1", "geoms from the update",
         "without a body");
  if (!options.empty()) all.push_back(options);
  return all;
}

PrintedFacts::PrintedFacts(const ParallelSAPSpace& space)
    : space_(&space), statistics_(space.pipeline().statistics) {
  Printing& all = printing();
  const std::lock_guard<std::mutex> lock(all.mutex);
  if (all.process == 0) std::atexit(printAtExit);
  if (all.process != processNumber()) all.facts.clear();  // its parent's
  all.process = processNumber();
  all.facts.insert(this);
}

PrintedFacts::~PrintedFacts() {
  const auto leavePrinting = [this] {
    const std::lock_guard<std::mutex> lock(printing().mutex);
    return printing().facts.erase(this) > 0;
  };
  if (leavePrinting())
    print([](const void* space, const char* text) {
      dMessage(0, "parallel SAP space %p: %s", space, text);
    });
}

void PrintedFacts::print(Print say) const {
  const FrameSums sums = statistics_.sums();
  for (const std::string& text : sums.lines()) say(space_, text.c_str());
  for (const std::string& text : lines(sums.average())) say(space_, text.c_str());
}

// To stderr, since a program's handler may be gone. A forked child ends without its parent's
// spaces. Other threads may use them still: of their sums numbers alone are read.
void PrintedFacts::printAtExit() {
  Printing& all = printing();
  const std::unique_lock<std::mutex> lock(all.mutex, std::try_to_lock);
  if (!lock || all.process != processNumber()) return;
  for (const PrintedFacts* const facts : all.facts)
    facts->print([](const void* space, const char* text) {
      std::fprintf(stderr, "parallel SAP space %p: %s\n", space, text);
    });
  all.facts.clear();
}

}  // namespace ode_parallel_sap
