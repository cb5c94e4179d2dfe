#include "space/advice/physics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <new>

#include "space/base/floating_point.h"

namespace ode_parallel_sap {

namespace {

// Thresholds lie between rows of tests/physics/results/double.csv, where nothing else is said.
constexpr double least_ratio = 10;      // 1:10 stands in 8 starts of 10, and so do stacks of less
constexpr double ratio_falls = 0.02;    // between 1:10 (0.01) and 1:30 (0.03)
constexpr double built_falls = 0.006;   // between stacks of 5 (0.0049) and 7, and logs (0.0061)
constexpr double heap_falls = 0.055;    // between the study's hopper (0.044), a wall (0.063)
constexpr double soft_falls = 0.012;    // CFM 1e-5, ERP 0.8: between stacks of 10 and 15 (0.0147)
constexpr double soft_share = 0.01;     // CFM 1e-5 with boxes of a tonne, which rescues these
constexpr double small_falls = 0.009;   // between boxes over cliffs (0.0016), a ruler (0.0098)
constexpr double fast_sizes = 1.75;     // between boxes at 15 m/s (1.5) and at 20 m/s (2)
constexpr double deep_share = 0.1;      // kDepth of outcome.cpp
constexpr double deep_ways = 3;         // an impact is as deep as its way, and not more (README.md)
constexpr double soft_sizes = 0.1;      // between boxes of 10^9 kg (0.049), sides of 1000 m (0.25)
constexpr double hanging_falls = 0.09;  // between a ring of 12 (0.039) and a chain of 10 (0.098)
constexpr double turning_angle = 0.02;  // a box about no axis of its own, 3 rad/s, drifts (0.03)
constexpr double spacing_share = 0.002;  // kCreep of outcome.cpp
constexpr double idle_share = 0.5;       // examples/SOLVER.md: boxes at rest
constexpr double contacts_a_pair = 5;    // examples/SOLVER.md: 4 do as well as 64

constexpr std::size_t most_geoms = 2048;  // fixed: of a look
constexpr std::size_t most_places = 64;   // fixed: any few
constexpr std::size_t most_overlaps = 8;  // fixed: each costs a dCollide
constexpr int most_joints = 128;          // fixed: of a body; dBodyGetJoint counts from the first
constexpr double least_idle = 16;         // fixed: bodies; fewer cost nothing

constexpr double infinity = std::numeric_limits<double>::infinity();

double number(dReal x) {
  return static_cast<double>(x);
}
double dot(const dReal* a, const dReal* b) {
  return number(a[0]) * number(b[0]) + number(a[1]) * number(b[1]) + number(a[2]) * number(b[2]);
}
double lengthOf(const dReal* v) {
  return std::sqrt(dot(v, v));
}
bool moves(dBodyID body) {
  return body && !dBodyIsKinematic(body);
}

// The smallest one first; endless for what nothing gets through.
std::array<double, 3> sidesOf(dGeomID geom) {
  std::array<double, 3> sides = {infinity, infinity, infinity};
  dReal radius = 0, length = 0;
  dVector3 lengths;
  dReal box[6];
  switch (dGeomGetClass(geom)) {
    case dPlaneClass:
    case dHeightfieldClass:
    case dRayClass:
      return sides;
    case dSphereClass:
      sides.fill(2 * number(dGeomSphereGetRadius(geom)));
      return sides;
    case dBoxClass:
      dGeomBoxGetLengths(geom, lengths);
      sides = {number(lengths[0]), number(lengths[1]), number(lengths[2])};
      break;
    case dCapsuleClass:
      dGeomCapsuleGetParams(geom, &radius, &length);
      sides = {2 * number(radius), 2 * number(radius), number(length) + 2 * number(radius)};
      break;
    case dCylinderClass:
      dGeomCylinderGetParams(geom, &radius, &length);
      sides = {2 * number(radius), 2 * number(radius), number(length)};
      break;
    default:
      dGeomGetAABB(geom, box);
      for (std::size_t i = 0; i < 3; ++i) sides[i] = number(box[2 * i + 1]) - number(box[2 * i]);
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

double reachOf(dGeomID geom, dBodyID body) {
  const dReal* const centre = dBodyGetPosition(body);
  dReal box[6];
  dGeomGetAABB(geom, box);
  dVector3 arm = {0, 0, 0, 0};
  for (int i = 0; i < 3; ++i) arm[i] = std::max(centre[i] - box[2 * i], box[2 * i + 1] - centre[i]);
  return lengthOf(arm);
}

// Of two geoms, as far as they move.
double smallerSize(dGeomID a, dGeomID b) {
  return std::min(moves(dGeomGetBody(a)) ? sidesOf(a)[1] : infinity,
                  moves(dGeomGetBody(b)) ? sidesOf(b)[1] : infinity);
}

// Whose collider any thread may call, with no data of its own.
bool isSimple(dGeomID geom) {
  const int type = dGeomGetClass(geom);
  return type == dSphereClass || type == dBoxClass || type == dCapsuleClass ||
         type == dCylinderClass || type == dPlaneClass;
}

// Calls use(joint, the other body) for the first joints of a body.
template <class Use>
void forJoints(dBodyID body, Use use) {
  const int joints = std::min(most_joints, dBodyGetNumJoints(body));
  for (int i = 0; i < joints; ++i) {
    const dJointID joint = dBodyGetJoint(body, i);
    const dBodyID first = dJointGetBody(joint, 0);
    use(joint, first == body ? dJointGetBody(joint, 1) : first);
  }
}

bool isContact(dJointID joint) {
  return dJointGetType(joint) == dJointTypeContact;
}

}  // namespace

void Physics::see(dGeomID a, dGeomID b) try {
  if (!isSimple(a) || !isSimple(b)) return;
  if (!moves(dGeomGetBody(a)) && !moves(dGeomGetBody(b))) return;
  // Contacts are no deeper than the AABBs, but for planes.
  dReal p[6], q[6];
  dGeomGetAABB(a, p);
  dGeomGetAABB(b, q);
  double overlap = infinity;
  for (int i = 0; i < 6; i += 2)
    overlap =
        std::min(overlap, number(std::min(p[i + 1], q[i + 1])) - number(std::max(p[i], q[i])));
  const Overlap found = {a, b, overlap / smallerSize(a, b)};
  if (!(found.share > deep_share)) return;
  if (overlaps_.size() < most_overlaps) return overlaps_.push_back(found);
  const auto least = std::min_element(
      overlaps_.begin(), overlaps_.end(),
      [](const Overlap& one, const Overlap& other) { return one.share < other.share; });
  if (least->share < found.share) *least = found;
} catch (const std::bad_alloc&) {
}

void Physics::lookFirst(const View& view) try {
  const ScopedMode mode(exactMode());
  places_.clear();
  if (!gather(view)) return;
  noteDepths(view.collide);
  const auto remember = [this](std::vector<Place>& places, std::size_t stride) {
    for (std::size_t i = 0; i < bodies_.size(); i += stride) {
      places.emplace_back();
      places.back().id = bodies_[i].id;
      dBodyCopyPosition(bodies_[i].id, places.back().position);
      dBodyCopyQuaternion(bodies_[i].id, places.back().turn);
    }
  };
  remember(places_, 1 + bodies_.size() / most_places);
  if (first_places_.empty()) remember(first_places_, 1);
} catch (const std::bad_alloc&) {
}

void Physics::lookAgain(const View& view) try {
  const ScopedMode mode(exactMode());
  // No body was awake then, or a callback left the first collide.
  const bool any = !places_.empty() && gather(view);
  from_ = from_ + most_geoms < view.count ? from_ + most_geoms : 0;
  if (!any) return;
  if (!swept_) measureStep();
  fall_ = gravity_ * step_ * step_;
  if (step_ > 0) {
    noteFast();
    noteContacts();
    noteJoints();
    noteTurning();
  }
} catch (const std::bad_alloc&) {
}

// False where no body moves.
bool Physics::gather(const View& view) {
  swept_ = view.swept > 0;
  if (swept_) step_ = number(view.swept);
  bodies_.clear();
  thinnest_fixed_ = infinity;
  any_sheet_ = false;
  for (std::size_t i = from_; i < std::min(view.count, from_ + most_geoms); ++i) {
    const dGeomID geom = view.geoms[i];
    if (!geom || dGeomIsSpace(geom)) continue;
    const dBodyID id = dGeomGetBody(geom);
    if (!moves(id)) {
      if (dGeomGetClass(geom) == dTriMeshClass)
        any_sheet_ = true;
      else
        thinnest_fixed_ = std::min(thinnest_fixed_, sidesOf(geom)[0]);
    } else if (dBodyIsEnabled(id)) {
      const std::array<double, 3> sides = sidesOf(geom);
      bodies_.emplace_back();
      bodies_.back().id = id;
      bodies_.back().size = sides[1];
      bodies_.back().thin = sides[0];
      bodies_.back().reach = reachOf(geom, id);
    }
  }
  if (bodies_.empty()) return false;
  mergeBodies();
  world_ = dBodyGetWorld(bodies_[0].id);
  dWorldGetGravity(world_, down_);
  gravity_ = lengthOf(down_);
  return true;
}

// Of each body's geoms one entry remains.
void Physics::mergeBodies() {
  std::sort(bodies_.begin(), bodies_.end(),
            [](const Body& a, const Body& b) { return std::less<dBodyID>()(a.id, b.id); });
  std::size_t last = 0;
  for (std::size_t i = 1; i < bodies_.size(); ++i) {
    if (bodies_[i].id != bodies_[last].id) {
      bodies_[++last] = bodies_[i];
      continue;
    }
    bodies_[last].size = std::max(bodies_[last].size, bodies_[i].size);
    bodies_[last].thin = std::max(bodies_[last].thin, bodies_[i].thin);
    bodies_[last].reach = std::max(bodies_[last].reach, bodies_[i].reach);
  }
  bodies_.resize(last + 1);
}

Physics::Body* Physics::find(dBodyID id) {
  const auto at = std::lower_bound(
      bodies_.begin(), bodies_.end(), id,
      [](const Body& body, dBodyID other) { return std::less<dBodyID>()(body.id, other); });
  return at != bodies_.end() && at->id == id ? &*at : nullptr;
}

// Whether it lies where the program put it. What fell there is a heap, which need not stand.
bool Physics::isBuilt(const Body& body) const {
  const auto at = std::lower_bound(
      first_places_.begin(), first_places_.end(), body.id,
      [](const Place& place, dBodyID id) { return std::less<dBodyID>()(place.id, id); });
  if (at == first_places_.end() || at->id != body.id) return false;
  dVector3 way;
  dSubtractVectors3(way, dBodyGetPosition(body.id), at->position);
  return lengthOf(way) < 0.1 * body.size;
}

// The median over bodies, by the way of each along its best axis since the first collide of this
// look, or by its angle.
void Physics::measureStep() {
  constexpr double epsilon = std::numeric_limits<dReal>::epsilon();
  std::vector<double> steps;
  for (const Place& place : places_) {
    if (!find(place.id)) continue;  // it may not exist any more
    const dReal *const now = dBodyGetPosition(place.id), *const v = dBodyGetLinearVel(place.id);
    double finest = 1000, step = 0;  // finest: way in spacings of numbers
    for (int i = 0; i < 3; ++i) {
      const double way = number(now[i]) - number(place.position[i]);
      const double spacings = std::fabs(way) / (epsilon * std::fabs(number(now[i])));
      if (!(spacings > finest) || v[i] == 0) continue;
      finest = spacings;
      step = way / number(v[i]);
    }
    dQuaternion by;
    dQMultiply2(by, dBodyGetQuaternion(place.id), place.turn);
    const double spin = lengthOf(dBodyGetAngularVel(place.id)), half = std::fabs(number(by[0]));
    if (step == 0 && spin > 0 && half > 0) step = 2 * lengthOf(by + 1) / half / spin;
    if (step > 0 && step < infinity) steps.push_back(step);
  }
  if (steps.empty()) return;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  step_ = *middle;
}

// Collides the pairs again of which the program has made contact joints.
void Physics::noteDepths(decltype(&dCollide) collide) {
  for (const Overlap& pair : overlaps_) {
    dBodyID body = dGeomGetBody(pair.a), other = dGeomGetBody(pair.b);
    if (!moves(body)) std::swap(body, other);
    if (!moves(body)) continue;  // by a callback
    bool touches = false;
    forJoints(body, [&](dJointID joint, dBodyID with) {
      touches = touches || (isContact(joint) && with == other);
    });
    const double speed =
        lengthOf(dBodyGetLinearVel(body)) + (other ? lengthOf(dBodyGetLinearVel(other)) : 0);
    if (!touches || (speed > 0 && step_ == 0)) continue;
    dContactGeom contacts[8];
    double depth = 0;
    const int found = collide(pair.a, pair.b, 8, contacts, sizeof(dContactGeom));
    for (int i = 0; i < found; ++i) depth = std::max(depth, number(contacts[i].depth));
    const double share = depth / smallerSize(pair.a, pair.b);
    if (depth > deep_ways * speed * step_) note(deep, share, deep_share, 100 * share);
  }
  overlaps_.clear();
}

// A body gets through what is thinner than its way; not if its middle stays in front of it.
void Physics::noteFast() {
  if (swept_) return;
  double thinnest = infinity, next = infinity;  // of bodies
  double mean[3] = {0, 0, 0};
  for (const Body& body : bodies_) {
    next = std::min(next, std::max(thinnest, body.thin));
    thinnest = std::min(thinnest, body.thin);
    for (int i = 0; i < 3; ++i)
      mean[i] += number(dBodyGetLinearVel(body.id)[i]) / static_cast<double>(bodies_.size());
  }
  for (const Body& body : bodies_) {
    const dReal* const v = dBodyGetLinearVel(body.id);
    // Bodies that fly side by side do not meet.
    const dVector3 apart = {v[0] - static_cast<dReal>(mean[0]), v[1] - static_cast<dReal>(mean[1]),
                            v[2] - static_cast<dReal>(mean[2])};
    const double turned = std::min(2.0, lengthOf(dBodyGetAngularVel(body.id)) * step_) * body.reach;
    const double way = lengthOf(v) * step_ + turned,
                 among_bodies = lengthOf(apart) * step_ + turned;
    const auto meets = [&](double way, double side, double thin) {
      if (side < infinity && way >= (body.thin + side) / 2)
        note(fast, way / thin, fast_sizes, way / thin);
    };
    meets(way, thinnest_fixed_, std::min(thinnest_fixed_, body.thin));
    if (any_sheet_) meets(way, 0, body.thin / 2);
    const double other = body.thin > thinnest ? thinnest : next;
    meets(among_bodies, other, std::min(other, body.thin));
  }
}

// What each body carries, handed down to those on which it lies, the highest first.
void Physics::noteContacts() {
  std::vector<Body*> order;
  for (Body& body : bodies_) {
    dMass mass;
    dBodyGetMass(body.id, &mass);
    body.mass = number(mass.mass);
    const double height = gravity_ > 0 ? -dot(dBodyGetPosition(body.id), down_) / gravity_ : 0;
    if (std::isfinite(height)) body.height = height;
    order.push_back(&body);
  }
  std::sort(order.begin(), order.end(),
            [](const Body* a, const Body* b) { return a->height > b->height; });
  double contacts = 0, pairs = 0, touching = 0, idle = 0;
  std::vector<dBodyID> others;
  std::vector<Body*> below;
  for (Body* body : order) {
    others.clear();
    below.clear();
    std::size_t bearers = 0;
    double heaviest = 0;  // of those that lie on it
    forJoints(body->id, [&](dJointID joint, dBodyID with) {
      if (!isContact(joint)) {
        body->jointed = true;
        return;
      }
      others.push_back(with);
      Body* const other = moves(with) ? find(with) : nullptr;
      const double least = other ? 0.1 * std::min(body->size, other->size) : 0;
      if (!other)
        ++bearers;
      else if (other->height < body->height - least)
        below.push_back(other);
      else if (other->height > body->height + least)
        heaviest = std::max(heaviest, other->mass);
    });
    if (others.empty()) continue;
    body->touches = true;
    contacts += static_cast<double>(others.size());
    std::sort(others.begin(), others.end(), std::less<dBodyID>());
    pairs += static_cast<double>(std::unique(others.begin(), others.end()) - others.begin());
    bearers += below.size();
    for (Body* other : below)
      other->carried += (body->mass + body->carried) / static_cast<double>(bearers);
    noteCarried(*body, heaviest);
    ++touching;
    idle += !dBodyGetAutoDisableFlag(body->id) &&
            lengthOf(dBodyGetLinearVel(body->id)) < gravity_ * step_ &&
            lengthOf(dBodyGetAngularVel(body->id)) * body->size < 2 * gravity_ * step_;
  }
  if (pairs > 0) note(many_contacts, contacts / pairs, contacts_a_pair, contacts / pairs);
  if (idle >= least_idle) note(restless, idle / touching, idle_share, 100 * idle / touching);
}

void Physics::noteCarried(const Body& body, double heaviest) {
  const double fall = fall_ / body.size, ratio = heaviest / body.mass;
  const double times = body.carried / body.mass;
  const double cfm = number(dWorldGetCFM(world_)), erp = number(dWorldGetERP(world_));
  if (ratio >= least_ratio) note(mass_ratio, ratio * fall, ratio_falls, ratio);
  const bool is_soft = cfm * body.mass >= soft_share && erp >= 0.8;
  const double most = !isBuilt(body) ? heap_falls : is_soft ? soft_falls : built_falls;
  if (times >= 0.5) note(load, (1 + times) * fall, most, times);
  note(small_body, fall, small_falls, 100 * fall);
  // By so much a contact gives that bears it all.
  const double sink = cfm * step_ * (body.mass + body.carried) * gravity_ / erp / body.size;
  note(soft, sink, soft_sizes, 100 * sink);
  const dReal* const at = dBodyGetPosition(body.id);
  const double spacing = number(std::numeric_limits<dReal>::epsilon()) * lengthOf(at) / body.size;
  note(far_away, spacing, spacing_share, lengthOf(at));
}

// What hangs on each body by joints, from the farthest from the world on.
void Physics::noteJoints() {
  std::vector<Body*> order;
  const auto forLinks = [this](Body* body, auto use) {
    forJoints(body->id, [&](dJointID joint, dBodyID with) {
      if (!isContact(joint)) use(moves(with) ? find(with) : nullptr);
    });
  };
  for (Body& body : bodies_) {
    body.carried = 0;
    if (!body.jointed) continue;
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
    double bearers = 0;
    const auto bears = [body](const Body* other) {
      return other && other->level == body->level - 1;
    };
    forLinks(body, [&](Body* other) { bearers += bears(other); });
    forLinks(body, [&](Body* other) {
      if (bears(other)) other->carried += (body->mass + body->carried) / bearers;
    });
    const double times = body->carried / body->mass;
    if (times >= 0.5) note(hanging, (1 + times) * fall_ / body->size, hanging_falls, times);
  }
}

// Bodies with three different moments of inertia that nothing touches. Under gravity something soon
// will.
void Physics::noteTurning() {
  for (const Body& body : bodies_) {
    if (body.touches || body.jointed || (gravity_ > 0 && dBodyGetGravityMode(body.id))) continue;
    dMass mass;
    dBodyGetMass(body.id, &mass);
    std::array<double, 3> inertia = {number(mass.I[0]), number(mass.I[5]), number(mass.I[10])};
    std::sort(inertia.begin(), inertia.end());
    const double angle = lengthOf(dBodyGetAngularVel(body.id)) * step_;
    if (inertia[1] > 1.01 * inertia[0] && inertia[2] > 1.01 * inertia[1])
      note(turning, angle, turning_angle, angle);
  }
}

void Physics::note(Regime regime, double measure, double threshold, double number) {
  Worst& worst = worst_[regime];
  if (measure / threshold > worst.excess) worst = {measure / threshold, number};
}

void Physics::add(const Physics& other) {
  for (std::size_t i = 0; i < regimes; ++i)
    if (other.worst_[i].excess > worst_[i].excess) worst_[i] = other.worst_[i];
}

std::vector<std::string> Physics::lines() const {
  // In the order of Regime: what was seen, and what rescues its rows in tests/physics.
  static const char* const forms[regimes] = {
      "mass-ratio: a body lies on one of 1/%.3g of its mass: dWorldStep, or a smaller step",
      "load: a body bears %.3g times its mass: ERP 0.8 with CFM 1e-5, dWorldStep, or a smaller "
      "step",
      "small: gravity moves a body by %.2g %% of its size in a step: a smaller step, or dWorldStep "
      "with CFM 1e-5",
      "fast: a body moves in a step by %.3g times the thickness of what it may hit: a smaller "
      "step, "
      "or dParallelSAPSpaceSetSweptBounds and steps in parts",
      "deep: a contact is %.3g %% of a body's size deep: dWorldSetContactMaxCorrectingVel, or "
      "dWorldStep with CFM 1e-5",
      "soft: CFM lets a body sink by %.3g %% of its size: CFM 0",
      "hanging: %.3g times a body's mass hang on its joints: a smaller step",
      "turning: a free body turns by %.2g radians in a step: dBodySetFiniteRotationMode, or a "
      "smaller step",
      "far: a body is %.3g from the origin, where numbers are coarse for its size: another origin",
      "restless: %.0f %% of the bodies that touch lie still and may not sleep: "
      "dWorldSetAutoDisableFlag",
      "contacts: a pair has %.2g contacts: at most 4, by dParallelSAPKeepSpread"};
  std::vector<std::string> all;
  for (std::size_t i = 0; i < regimes; ++i) {
    if (worst_[i].excess < 1) continue;
    char line[192];
    std::snprintf(line, sizeof line, forms[i], worst_[i].number);
    all.emplace_back(line);
  }
  return all;
}

}  // namespace ode_parallel_sap
