#include "space/advice/advice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <set>

#include "space/advice/joints.h"
#include "space/advice/shapes.h"
#include "space/base/floating_point.h"
#include "space/contacts/collider_threads.h"

namespace ode_parallel_sap {

namespace {

// What is seen, and from which measure on. A limit lies between rows of
// tests/physics/results/double.csv, where nothing else is said. What a remedy says is played in
// tests/lifecycle/warnings_test.cpp.
struct Row {
  double limit;
  const char *name, *text;
};
constexpr Row table[] = {
    // In falls: sizes by which gravity moves a body in a step.
    {0.02, "mass-ratio", "a body lies on one of 1/%.3g of its mass"},  // 1:10 (0.01), 1:30 (0.03)
    {0.0055, "load", "a body bears %.3g times its mass"},  // stacks of 5 (0.0049), 7 (0.0057)
    {3, "aligned", "%.0f bodies lie exactly above each other, which dWorldStep may throw"},
    {0.009,  // boxes over cliffs (0.0016), a ruler (0.0098)
     "small", "gravity moves a body by %.2g %% of its size in a step"},
    // In sizes.
    {1.75,  // boxes at 15 m/s (1.5) and at 20 m/s (2)
     "fast", "a body moves in a step by %.3g times the thickness of what it may hit"},
    {0.1, "deep", "a contact is %.3g %% of a body's size deep"},  // kDepth of outcome.cpp
    {0.1,  // boxes of 10^9 kg (0.049), sides of 1000 m (0.25)
     "soft", "CFM lets a body sink by %.3g %% of its size"},
    {0.02, "hanging", "%.4g times a body's mass hang on its joints, which gape"},
    {0.6,  // 1 % of the length of two to seven links
     "held", "motors hold %.3g links in a row, and QuickStep lets them drop"},
    {0.02, "turning", "a free body loses half of its wobble in about %.2g s"},  // radians a step
    {0.002,  // sizes; kCreep of outcome.cpp
     "far", "a body is %.3g from the origin, where numbers are coarse for its size"},
    {1, "forces",
     "those of QuickStep's contacts, which are read, may be noise of %.0f %% and more"},
    {0.5, "restless", "%.0f %% of the bodies that touch lie still and may not sleep"},
    {5, "contacts", "a pair has %.2g contacts"}};  // examples/SOLVER.md: 4 do as well as 64

constexpr double least_ratio = 10;      // 1:10 stands in 8 starts of 10, and so do stacks of less
constexpr double heap_falls = 0.055;    // between the study's hopper (0.044), a wall (0.063)
constexpr double hanging_falls = 0.09;  // between a ring of 12 (0.039) and a chain of 10 (0.098)
constexpr double soft_falls = 0.012;    // CFM of step/mass: between stacks of 10 and 15 (0.0147)
constexpr double most_sink = 0.016;     // sizes; likewise: CFM of step/mass lets them sag by 2 %
constexpr double deep_ways = 2;         // an impact is as deep as its way, and not more (README.md)
constexpr double least_wrong =
    0.25;  // sizes; between meshes that fall (0.21) and cubes that are flung (0.3)
constexpr double flight = 2;  // sizes; bodies that fall farther meet something else

constexpr std::size_t most_geoms = 2048;                    // fixed: of a look
constexpr std::size_t most_overlaps = 8;                    // fixed: the header says so
constexpr std::size_t least_glance = 8, most_glance = 128;  // fixed: geoms a collide; costs little
constexpr double least_idle = 16;                           // fixed: bodies; fewer cost nothing

}  // namespace

void Physics::see(dGeomID a, dGeomID b) try {
  const bool one = moves(dGeomGetBody(a)), other = moves(dGeomGetBody(b));
  world_pairs_ += one != other;
  if (!one && !other) return;
  if (colliderUse(a, b) == ColliderUse::CallingThread) return;  // the program's own code
  // Contacts of simple geoms are no deeper than the AABBs. Those of others may be.
  dReal p[6], q[6];
  dGeomGetAABB(a, p);
  dGeomGetAABB(b, q);
  double overlap = infinity;
  for (int i = 0; i < 6; i += 2)
    overlap =
        std::min(overlap, number(std::min(p[i + 1], q[i + 1])) - number(std::max(p[i], q[i])));
  const Overlap found = {a, b, overlap / smallerSize(a, b)};
  if (!(found.share > table[deep].limit) && isSimple(a) && isSimple(b)) return;
  if (overlaps_.size() < most_overlaps) return overlaps_.push_back(found);
  const auto least = std::min_element(
      overlaps_.begin(), overlaps_.end(),
      [](const Overlap& one, const Overlap& other) { return one.share < other.share; });
  if (least->share < found.share) *least = found;
} catch (const std::bad_alloc&) {
}

void Physics::lookFirst(const dGeomID* geoms, std::size_t count, dReal swept) try {
  const ScopedMode mode(exactMode());
  places_.clear();
  if (!gather(geoms, count, swept)) return;
  findDepths();
  noteDepths();
  for (const auto& [id, body] : bodies_) {
    Place& place = places_[id];
    dBodyCopyPosition(id, place.position);
    dBodyCopyQuaternion(id, place.turn);
    std::copy_n(dBodyGetLinearVel(id), 3, place.speed);
  }
  if (first_places_.empty()) first_places_ = places_;
} catch (const std::bad_alloc&) {
}

void Physics::lookAgain(const dGeomID* geoms, std::size_t count, dReal swept) try {
  const ScopedMode mode(exactMode());
  // No body was awake then, or a callback left the first collide.
  const bool any = !places_.empty() && gather(geoms, count, swept);
  from_ = from_ + most_geoms < count ? from_ + most_geoms : 0;
  known_ = count;
  if (!any) return;
  if (!swept_) measureStep();
  is_quick_ = dRandGetSeed() != seed_;
  fall_ = gravity_ * step_ * step_;
  noteDepths();
  if (step_ > 0) {
    noteFast();
    noteContacts();
    noteJoints();
    noteTurning();
  }
} catch (const std::bad_alloc&) {
}

bool Physics::glance(const dGeomID* geoms, std::size_t count) {
  const ScopedMode mode(exactMode());
  std::size_t found = count > known_ ? known_ : count;
  known_ = count;
  const std::size_t share = std::clamp<std::size_t>(count / 16, least_glance, most_glance);
  for (std::size_t i = 0; i < std::min(share, count) && found == count; ++i) {
    if (glance_ >= count) glance_ = 0;
    if (isUrgent(geoms[glance_])) found = glance_;
    ++glance_;
  }
  if (found < count) from_ = found / most_geoms * most_geoms;
  return found < count;
}

// Fast enough to get through something, or as fast as ODE pushes it out of what it is deep in.
bool Physics::isUrgent(dGeomID geom) const {
  if (!geom || dGeomIsSpace(geom)) return false;
  const dBodyID body = dGeomGetBody(geom);
  if (!moves(body) || !dBodyIsEnabled(body)) return false;
  const double speed = lengthOf(dBodyGetLinearVel(body)), way = speed * step_;
  if (bodies_.empty() || (step_ == 0 && speed > 0)) return true;
  const std::array<double, 3> sides = sidesOf(geom);
  if (way > sides[0] / 2) return !swept_;
  if (way < table[deep].limit * number(dWorldGetERP(world_)) * sides[1]) return false;
  bool touches = false;
  forJoints(body, [&](dJointID joint, dBodyID) { touches = touches || isContact(joint); });
  return touches;
}

// False where no body moves.
bool Physics::gather(const dGeomID* geoms, std::size_t count, dReal swept) {
  swept_ = swept > 0;
  if (swept_) step_ = number(swept);
  bodies_.clear();
  thinnest_fixed_ = infinity;
  any_sheet_ = false;
  for (std::size_t i = from_; i < std::min(count, from_ + most_geoms); ++i) {
    const dGeomID geom = geoms[i];
    if (!geom || dGeomIsSpace(geom)) continue;
    const dBodyID id = dGeomGetBody(geom);
    if (!moves(id)) {
      if (dGeomGetClass(geom) == dTriMeshClass)
        any_sheet_ = true;
      else
        thinnest_fixed_ = std::min(thinnest_fixed_, sidesOf(geom)[0]);
    } else if (dBodyIsEnabled(id)) {
      const std::array<double, 3> sides = sidesOf(geom);
      Body& body = bodies_[id];
      body.id = id;
      body.geom = geom;
      body.size = std::max(body.size, sides[1]);
      body.thin = std::max(body.thin, sides[0]);
      body.along = std::max(body.along, sideAlong(geom, dBodyGetLinearVel(id)));
      body.length = std::max(body.length, sides[2]);
      body.turns = std::max(body.turns, sweepingTurn(geom, id));
      body.reach = std::max(body.reach, reachOf(geom, id));
    }
  }
  if (bodies_.empty()) return false;
  world_ = dBodyGetWorld(bodies_.begin()->first);
  dWorldGetGravity(world_, down_);
  gravity_ = lengthOf(down_);
  return true;
}

Physics::Body* Physics::find(dBodyID id) {
  const auto at = bodies_.find(id);
  return at == bodies_.end() ? nullptr : &at->second;
}

// Whether it lies where the program put it. What fell there is a heap, which need not stand.
bool Physics::isBuilt(const Body& body) const {
  const auto at = first_places_.find(body.id);
  if (at == first_places_.end()) return false;
  dVector3 way;
  dSubtractVectors3(way, dBodyGetPosition(body.id), at->second.position);
  return lengthOf(way) < 0.1 * body.size;
}

// Whether one was exactly above the other in the first collide.
bool Physics::areAligned(const Body& a, const Body& b) const {
  const auto one = places_.find(a.id), other = places_.find(b.id);
  if (one == places_.end() || other == places_.end()) return false;
  dVector3 way, across;
  dSubtractVectors3(way, one->second.position, other->second.position);
  dCalcVectorCross3(across, way, down_);
  return lengthOf(across) < 1e-9 * gravity_ * b.size;
}

// The median over bodies, by the way of each along its best axis since the first collide of this
// look, or by its angle.
void Physics::measureStep() {
  constexpr double epsilon = std::numeric_limits<dReal>::epsilon();
  std::vector<double> steps;
  for (const auto& [id, place] : places_) {
    if (!find(id)) continue;  // it may not exist any more
    const dReal *const now = dBodyGetPosition(id), *const v = dBodyGetLinearVel(id);
    double finest = 1000, step = 0;  // finest: way in spacings of numbers
    for (int i = 0; i < 3; ++i) {
      const double way = number(now[i]) - number(place.position[i]);
      const double spacings = std::fabs(way) / (epsilon * std::fabs(number(now[i])));
      if (!(spacings > finest) || v[i] == 0) continue;
      finest = spacings;
      step = way / number(v[i]);
    }
    dQuaternion by;
    dQMultiply2(by, dBodyGetQuaternion(id), place.turn);
    const double spin = lengthOf(dBodyGetAngularVel(id)), half = std::fabs(number(by[0]));
    if (step == 0 && spin > 0 && half > 0) step = 2 * lengthOf(by + 1) / half / spin;
    if (step > 0 && step < infinity) steps.push_back(step);
  }
  if (steps.empty()) return;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  step_ = *middle;
}

// Collides the pairs again of which the program has made contact joints.
void Physics::findDepths() {
  depths_.clear();
  for (const auto& [a, b, overlap] : overlaps_) {
    dBodyID body = dGeomGetBody(a), other = dGeomGetBody(b);
    if (!moves(body)) std::swap(body, other);
    if (!moves(body)) continue;  // by a callback
    bool touches = false, is_jointed = false;
    const auto lookAt = [&](dJointID joint, dBodyID with) {
      if (!isContact(joint))
        is_jointed = true;
      else if (with == other || with == body)
        touches = true;
    };
    forJoints(body, lookAt);
    if (!touches) continue;
    if (other) forJoints(other, lookAt);
    Depth found = {a, b, 0, 0, smallerSize(a, b), lengthOf(dBodyGetLinearVel(body))};
    // What helps bodies without joints. Those of meshes and convexes may be deep where they touch.
    if (!is_jointed)
      found.correction =
          std::sqrt(std::max(gravity_, 1.0) * found.size) / (isSimple(a) && isSimple(b) ? 3 : 30);
    if (other) found.speed += lengthOf(dBodyGetLinearVel(other));
    dContactGeom contacts[64];
    const int count = collideInTurn(a, b, 64, contacts, sizeof(dContactGeom));
    for (int i = 0; i < count; ++i) found.depth = std::max(found.depth, number(contacts[i].depth));
    depths_.push_back(found);
  }
}

// First hits of meshes and convexes are deep, and harmless while they push bodies the way they
// came.
void Physics::noteDepths() {
  for (const auto& [a, b, correction, depth, size, speed] : depths_) {
    const double share = depth / size;
    const double most = isSimple(a) && isSimple(b) ? table[deep].limit : least_wrong;
    if ((speed == 0 || step_ > 0) && depth > deep_ways * speed * step_ &&
        note(deep, share * table[deep].limit / most, 100 * share, a, b) && correction > 0)
      remedy(deep, "dWorldSetContactMaxCorrectingVel of %.2g", correction);
  }
}

// A body gets through what is thinner than its way; not if its middle stays in front of it.
void Physics::noteFast() {
  if (swept_) return;
  double thinnest = infinity, next = infinity;  // of bodies
  double mean[3] = {0, 0, 0};
  for (const auto& [id, body] : bodies_) {
    next = std::min(next, std::max(thinnest, body.thin));
    thinnest = std::min(thinnest, body.thin);
    for (int i = 0; i < 3; ++i)
      mean[i] += number(dBodyGetLinearVel(id)[i]) / static_cast<double>(bodies_.size());
  }
  for (const auto& entry : bodies_) {
    const Body& body = entry.second;
    const dReal* const v = dBodyGetLinearVel(body.id);
    // Bodies that fly side by side do not meet.
    const dVector3 apart = {v[0] - static_cast<dReal>(mean[0]), v[1] - static_cast<dReal>(mean[1]),
                            v[2] - static_cast<dReal>(mean[2])};
    const double turned = std::min(2.0, body.turns * step_) * body.reach;
    const auto meets = [&](double way, double own, double side, double thin) {
      if (side < infinity && way >= (own + side) / 2 &&
          note(fast, way / thin, way / thin, body.geom))
        remedy(fast, "steps of %.2g s, or dParallelSAPSpaceSetSweptBounds, -CollideSwept",
               step_ * 1.4 * thin / way);
    };
    const double other = body.thin > thinnest ? thinnest : next;
    const auto meetsAny = [&](double way, double among_bodies, double own) {
      meets(way, own, thinnest_fixed_, std::min(thinnest_fixed_, own));
      if (any_sheet_) meets(way, own, 0, own / 2);
      meets(among_bodies, own, other, std::min(other, own));
    };
    // Edge on, a wheel is as thick as it is wide.
    meetsAny(lengthOf(v) * step_, lengthOf(apart) * step_, body.along);
    meetsAny(turned, turned, body.thin);
  }
}

// What each body carries, handed down to those on which it lies, the highest first.
void Physics::noteContacts() {
  std::vector<Body*> order;
  for (auto& [id, body] : bodies_) {
    dMass mass;
    dBodyGetMass(body.id, &mass);
    body.mass = number(mass.mass);
    const double height = gravity_ > 0 ? -dot(dBodyGetPosition(body.id), down_) / gravity_ : 0;
    if (std::isfinite(height)) body.height = height;
    order.push_back(&body);
  }
  std::sort(order.begin(), order.end(),
            [](const Body* a, const Body* b) { return a->height > b->height; });
  double contacts = 0, pairs = 0, on_world = 0, touching = 0, idle = 0;
  bool are_read = false;
  lightest_ = infinity;
  sink_ = 0;
  std::set<dBodyID> others;
  std::vector<Body*> below;
  for (Body* body : order) {
    others.clear();
    below.clear();
    std::size_t bearers = 0;
    forJoints(body->id, [&](dJointID joint, dBodyID with) {
      if (!isContact(joint)) {
        sink_ = infinity;  // CFM would soften it
        body->jointed = true;
        body->is_held = body->is_held || holds(joint);
        return;
      }
      others.insert(with);
      ++contacts;
      are_read = are_read || dJointGetFeedback(joint);
      Body* const other = find(with);
      const double least = other ? 0.1 * std::min(body->size, other->size) : 0;
      if (!other)
        ++bearers;
      else if (other->height < body->height - least)
        below.push_back(other);
      else if (other->height > body->height + least)
        body->heaviest = std::max(body->heaviest, other->mass);
    });
    if (others.empty()) continue;
    body->touches = true;
    on_world += static_cast<double>(others.erase(nullptr));
    pairs += static_cast<double>(others.size());
    bearers += below.size();
    for (Body* other : below) {
      if (areAligned(*body, *other))
        other->straight = std::max(other->straight, body->straight + 1);
      other->carried += (body->mass + body->carried) / static_cast<double>(bearers);
      other->storeys = std::max(other->storeys, body->storeys + 1);
    }
    if (!is_quick_ && note(aligned, body->straight, body->straight, body->geom))
      remedy(aligned, "move each by 1e-5 of its size");
    lightest_ = std::min(lightest_, body->mass);
    sink_ = std::max(sink_, (body->mass + body->carried) * body->storeys / body->size);
    ++touching;
    idle += !dBodyGetAutoDisableFlag(body->id) &&
            lengthOf(dBodyGetLinearVel(body->id)) < gravity_ * step_ &&
            lengthOf(dBodyGetAngularVel(body->id)) * body->size < 2 * gravity_ * step_;
  }
  // Four contacts with ERP 0.8 give by so much, half as much on average of all storeys.
  sink_ *= fall_ / lightest_ / 8 / 0.8;
  for (const Body* body : order)
    if (body->touches) noteCarried(*body);
  pairs += std::max(on_world, world_pairs_);  // a body may touch several geoms of the world
  if (pairs > 0 && note(many_contacts, contacts / pairs, contacts / pairs))
    remedy(many_contacts, "at most 4, by dParallelSAPKeepSpread");
  if (idle >= least_idle && note(restless, idle / touching, 100 * idle / touching))
    remedy(restless, "dWorldSetAutoDisableFlag");
  if (are_read && is_quick_ && number(dWorldGetCFM(world_)) < 0.1 * step_ / lightest_ &&
      note(forces, 1, 6) && sink_ < infinity)
    remedy(forces, "CFM %.2g", step_ / lightest_);
}

void Physics::noteCarried(const Body& body) {
  const double fall = fall_ / body.size, ratio = body.heaviest / body.mass;
  const double all = 1 + body.carried / body.mass;
  const double cfm = number(dWorldGetCFM(world_)), erp = number(dWorldGetERP(world_));
  const bool is_soft = cfm >= 0.9 * step_ / lightest_ && erp >= 0.8;
  // Steps which hold ratios and stacks at all scales.
  const auto advise = [&](Regime regime, double parts) {
    if (sink_ <= most_sink && !is_soft)
      remedy(regime, "ERP 0.8 and CFM %.2g, or steps of %.2g s", step_ / lightest_, step_ / parts);
    else
      remedy(regime, "steps of %.2g s", step_ / parts);
  };
  const bool is_heavy = ratio >= least_ratio, is_ratio = ratio * fall >= table[mass_ratio].limit;
  if (is_quick_ && is_heavy && !(is_soft && sink_ <= most_sink) &&
      note(mass_ratio, ratio * fall, ratio, body.geom))
    advise(mass_ratio, ratio * std::sqrt(fall / 0.04));
  const double usual = table[load].limit;
  const double most = !isBuilt(body) ? heap_falls : is_soft ? soft_falls : usual;
  if (is_quick_ && all >= 1.5 && !(is_heavy && is_ratio) &&
      note(load, all * fall * usual / most, all - 1, body.geom))
    advise(load, all * std::sqrt(is_heavy ? fall / 0.04 : all * fall / 0.02));
  if (note(small_body, fall, 100 * fall, body.geom))
    remedy(small_body, "steps of %.2g s", step_ * std::sqrt(0.0004 / fall));
  // By so much a contact gives that bears it all.
  const double sink = cfm * step_ * all * body.mass * gravity_ / erp / body.size;
  if (note(soft, sink, 100 * sink, body.geom)) remedy(soft, "CFM %.2g", cfm * 0.01 / sink);
  const dReal* const at = dBodyGetPosition(body.id);
  const double spacing = number(std::numeric_limits<dReal>::epsilon()) * lengthOf(at) / body.size;
  if (note(far_away, spacing, lengthOf(at), body.geom)) remedy(far_away, "another origin");
}

// What joints hold, from the farthest from the world on.
void Physics::noteJoints() {
  std::vector<Body*> order;
  const auto forLinks = [this](Body* body, auto use) {
    forJoints(body->id, [&](dJointID joint, dBodyID with) {
      if (!isContact(joint)) use(find(with));
    });
  };
  for (auto& [id, body] : bodies_) {
    if (!body.jointed) continue;
    body.carried = 0;
    bool is_fixed = false;
    forLinks(&body, [&](Body* other) { is_fixed = is_fixed || !other; });
    if (!is_fixed) continue;
    body.level = 0;
    order.push_back(&body);
  }
  for (std::size_t i = 0; i < order.size(); ++i)
    forLinks(order[i], [&](Body* other) {
      if (!other || other->level >= 0) return;
      other->level = order[i]->level + 1;
      order.push_back(other);
    });
  for (auto at = order.rbegin(); at != order.rend(); ++at) {
    Body* const body = *at;
    double bearers = 0, gap = 0;
    const auto bears = [body](const Body* other) {
      return other && other->level == body->level - 1;
    };
    forLinks(body, [&](Body* other) { bearers += bears(other); });
    forJoints(body->id, [&](dJointID joint, dBodyID with) {
      gap = std::max(gap, gapOf(joint) / body->length);
      Body* const other = isContact(joint) ? nullptr : find(with);
      if (!bears(other)) return;
      other->carried += (body->mass + body->carried) / bearers;
      other->links = std::max(other->links, body->links + 1);
    });
    const double all = 1 + body->carried / body->mass;
    if (all >= 1.5 && all * fall_ / body->size >= hanging_falls &&
        note(hanging, gap, all - 1, body->geom))
      remedy(hanging, "steps of %.2g s", step_ * std::min(0.5, 0.5 * table[hanging].limit / gap));
    if (!is_quick_ || !body->is_held || body->level > 0) continue;
    const double links = body->links, pace = 20.0 / dWorldGetQuickStepNumIterations(world_);
    const double drop = std::pow(links, 3.5) * std::sqrt(fall_ / body->length) * pace;
    if (note(held, drop, links, body->geom))
      remedy(held, "dWorldStep, if no stack is exactly aligned, or steps of %.2g s",
             step_ * 0.7 * table[held].limit / drop);
  }
}

// Bodies that nothing touches or lets fall, and whose axis of rotation is none of their own.
void Physics::noteTurning() {
  for (const auto& [id, body] : bodies_) {
    const auto at = places_.find(id);
    if (body.touches || body.jointed || at == places_.end()) continue;
    const dReal *const now = dBodyGetLinearVel(id), *const turn = dBodyGetAngularVel(id);
    dVector3 fallen, rate, momentum, across;
    for (int i = 0; i < 3; ++i)
      fallen[i] = now[i] - at->second.speed[i] - down_[i] * static_cast<dReal>(step_);
    if (gravity_ > 0 && dBodyGetGravityMode(id) && lengthOf(fallen) < 0.5 * gravity_ * step_)
      continue;
    dMass mass;
    dBodyGetMass(id, &mass);
    dBodyVectorFromWorld(id, turn[0], turn[1], turn[2], rate);
    dMultiply0_331(momentum, mass.I, rate);
    dCalcVectorCross3(across, rate, momentum);
    const double speed = lengthOf(rate), angle = speed * step_, lasts = 0.51 / (angle * speed);
    if (lengthOf(across) < 0.01 * speed * lengthOf(momentum)) continue;
    const double pull = dBodyGetGravityMode(id) ? gravity_ : 0;
    if (pull * lasts * lasts / 2 < flight * body.size && note(turning, angle, lasts, body.geom))
      remedy(turning, "steps of %.2g s make that ten times longer", step_ / 10);
  }
}

// Whether it is the worst so far.
bool Physics::note(Regime regime, double measure, double number, dGeomID a, dGeomID b) {
  const double excess = measure / table[regime].limit;
  Worst& worst = worst_[regime];
  if (excess >= 1 && worst.last_look != looks_) {
    if (worst.looks++ == 0) worst.first = frame_;
    worst.last_look = looks_;
    worst.last = frame_;
  }
  if (!(excess > worst.excess)) return false;
  worst.excess = excess;
  worst.number = number;
  worst.geoms[0] = a;
  worst.geoms[1] = b;
  worst.have_left[0] = worst.have_left[1] = false;
  worst.remedy[0] = 0;
  return true;
}

template <class... Numbers>
void Physics::remedy(Regime regime, const char* text, Numbers... numbers) {
  if constexpr (sizeof...(numbers) == 0)
    std::snprintf(worst_[regime].remedy, sizeof worst_[regime].remedy, "%s", text);
  else
    std::snprintf(worst_[regime].remedy, sizeof worst_[regime].remedy, text, numbers...);
}

void Physics::add(const Physics& other) {
  for (std::size_t i = 0; i < regimes; ++i) {
    const Worst more = other.worst_[i], before = worst_[i];
    Worst& all = worst_[i];
    if (more.excess > before.excess) all = more;
    all.looks = before.looks + more.looks;
    all.first = !before.looks ? more.first
                : !more.looks ? before.first
                              : std::min(before.first, more.first);
    all.last = std::max(before.last, more.last);
  }
  looks_ += other.looks_;
}

// A load that one look of several has seen is on its way to rest.
bool Physics::isNamed(std::size_t regime) const {
  const Worst& worst = worst_[regime];
  const bool lasts = regime == load || regime == mass_ratio;
  return worst.excess >= 1 && (!lasts || worst.looks > 1 || looks_ < 3);
}

bool Physics::find(int line, dParallelSAPWarning* warning) const {
  for (std::size_t i = 0; i < regimes; ++i) {
    const Worst& worst = worst_[i];
    if (!isNamed(i) || line-- > 0) continue;
    const auto geom = [&worst](int j) { return worst.have_left[j] ? nullptr : worst.geoms[j]; };
    *warning = {table[i].name, geom(0), geom(1), worst.looks, worst.first, worst.last};
    return true;
  }
  return false;
}

void Physics::forget(const dxGeom* geom) {
  for (Worst& worst : worst_)
    for (int i = 0; i < 2; ++i) worst.have_left[i] |= !geom || worst.geoms[i] == geom;
  const auto isOf = [=](const Overlap& overlap) {
    return !geom || overlap.a == geom || overlap.b == geom;
  };
  overlaps_.erase(std::remove_if(overlaps_.begin(), overlaps_.end(), isOf), overlaps_.end());
}

std::vector<std::string> Physics::lines() const {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < regimes; ++i) {
    const Worst& worst = worst_[i];
    if (!isNamed(i)) continue;
    char line[512];
    int at = std::snprintf(line, sizeof line, "%s: ", table[i].name);
    const auto add = [&](const char* text, auto... values) {
      at += std::snprintf(line + at, sizeof line - static_cast<std::size_t>(at), text, values...);
    };
    add(table[i].text, worst.number);
    // Where a load pushes bodies into each other, they must be pushed out fast.
    const bool is_pushed =
        i == deep &&
        (worst_[load].excess >= 1 || worst_[mass_ratio].excess >= 1 || worst_[aligned].excess >= 1);
    if (worst.remedy[0] && !is_pushed) add(": %s", worst.remedy);
    add(" (%u of %u looks, collides %llu to %llu", worst.looks, looks_, worst.first, worst.last);
    if (worst.geoms[0]) add("; geom %p", static_cast<void*>(worst.geoms[0]));
    if (worst.geoms[1]) add(" and %p", static_cast<void*>(worst.geoms[1]));
    add(")");
    all.emplace_back(line);
  }
  return all;
}

}  // namespace ode_parallel_sap
