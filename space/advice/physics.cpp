#include "space/advice/advice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <set>

#include "space/base/floating_point.h"
#include "space/contacts/collider_threads.h"

namespace ode_parallel_sap {

namespace {

// What is seen, from which measure on, and what rescues its rows in tests/physics. A limit lies
// between rows of tests/physics/results/double.csv, where nothing else is said.
struct Row {
  double limit;
  const char* text;
};
constexpr Row table[] = {
    // In falls: sizes by which gravity moves a body in a step.
    {0.02,  // between 1:10 (0.01) and 1:30 (0.03)
     "mass-ratio: a body lies on one of 1/%.3g of its mass: dWorldStep, or a smaller step"},
    {0.006,  // between stacks of 5 (0.0049) and 7, and logs (0.0061)
     "load: a body bears %.3g times its mass: ERP 0.8 with CFM 1e-5, dWorldStep, or a smaller "
     "step"},
    {0.009,  // between boxes over cliffs (0.0016), a ruler (0.0098)
     "small: gravity moves a body by %.2g %% of its size in a step: a smaller step, or dWorldStep "
     "with CFM 1e-5"},
    // In sizes.
    {1.75,  // between boxes at 15 m/s (1.5) and at 20 m/s (2)
     "fast: a body moves in a step by %.3g times the thickness of what it may hit: a smaller step, "
     "or dParallelSAPSpaceSetSweptBounds and steps in parts"},
    {0.1,  // kDepth of outcome.cpp
     "deep: a contact is %.3g %% of a body's size deep: dWorldSetContactMaxCorrectingVel, or "
     "dWorldStep with CFM 1e-5"},
    {0.1,  // between boxes of 10^9 kg (0.049), sides of 1000 m (0.25)
     "soft: CFM lets a body sink by %.3g %% of its size: CFM 0"},
    {0.09,  // falls; between a ring of 12 (0.039) and a chain of 10 (0.098)
     "hanging: %.3g times a body's mass hang on its joints: a smaller step"},
    {0.02,  // a box about no axis of its own, 3 rad/s, drifts (0.03)
     "turning: a free body turns by %.2g radians in a step: dBodySetFiniteRotationMode, or a "
     "smaller step"},
    {0.002,  // sizes; kCreep of outcome.cpp
     "far: a body is %.3g from the origin, where numbers are coarse for its size: another origin"},
    {0.5,  // examples/SOLVER.md: boxes at rest
     "restless: %.0f %% of the bodies that touch lie still and may not sleep: "
     "dWorldSetAutoDisableFlag"},
    {5,  // examples/SOLVER.md: 4 do as well as 64
     "contacts: a pair has %.2g contacts: at most 4, by dParallelSAPKeepSpread"}};

constexpr double least_ratio = 10;    // 1:10 stands in 8 starts of 10, and so do stacks of less
constexpr double heap_falls = 0.055;  // between the study's hopper (0.044), a wall (0.063)
constexpr double soft_falls = 0.012;  // CFM 1e-5, ERP 0.8: between stacks of 10 and 15 (0.0147)
constexpr double soft_share = 0.01;   // CFM 1e-5 with boxes of a tonne, which rescues these
constexpr double deep_ways = 3;       // an impact is as deep as its way, and not more (README.md)

constexpr std::size_t most_geoms = 2048;  // fixed: of a look
constexpr int most_joints = 128;          // fixed: of a body; dBodyGetJoint counts from the first
constexpr std::size_t most_overlaps = 8;  // fixed: the header says so
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
  if (!(found.share > table[deep].limit)) return;
  if (overlaps_.size() < most_overlaps) return overlaps_.push_back(found);
  const auto least = std::min_element(
      overlaps_.begin(), overlaps_.end(),
      [](const Overlap& one, const Overlap& other) { return one.share < other.share; });
  if (least->share < found.share) *least = found;
} catch (const std::bad_alloc&) {
}

void Physics::forget(const dxGeom* geom) {
  const auto isOf = [=](const Overlap& overlap) {
    return !geom || overlap.a == geom || overlap.b == geom;
  };
  overlaps_.erase(std::remove_if(overlaps_.begin(), overlaps_.end(), isOf), overlaps_.end());
}

bool Physics::lookFirst(const dGeomID* geoms, std::size_t count, dReal swept) try {
  const ScopedMode mode(exactMode());
  places_.clear();
  if (!gather(geoms, count, swept)) return false;
  noteDepths();
  for (const auto& [id, body] : bodies_) {
    dBodyCopyPosition(id, places_[id].position);
    dBodyCopyQuaternion(id, places_[id].turn);
  }
  if (first_places_.empty()) first_places_ = places_;
  return true;
} catch (const std::bad_alloc&) {
  return true;
}

void Physics::lookAgain(const dGeomID* geoms, std::size_t count, dReal swept) try {
  const ScopedMode mode(exactMode());
  // No body was awake then, or a callback left the first collide.
  const bool any = !places_.empty() && gather(geoms, count, swept);
  from_ = from_ + most_geoms < count ? from_ + most_geoms : 0;
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
      body.size = std::max(body.size, sides[1]);
      body.thin = std::max(body.thin, sides[0]);
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
void Physics::noteDepths() {
  const auto collide = ode_collide.load(std::memory_order_relaxed);
  for (const Overlap& overlap : overlaps_) {
    const dGeomID a = overlap.a, b = overlap.b;
    dBodyID body = dGeomGetBody(a), other = dGeomGetBody(b);
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
    const int found = collide(a, b, 8, contacts, sizeof(dContactGeom));
    for (int i = 0; i < found; ++i) depth = std::max(depth, number(contacts[i].depth));
    const double share = depth / smallerSize(a, b);
    if (depth > deep_ways * speed * step_) note(deep, share, 100 * share);
  }
  overlaps_.clear();
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
    const double turned = std::min(2.0, lengthOf(dBodyGetAngularVel(body.id)) * step_) * body.reach;
    const double way = lengthOf(v) * step_ + turned,
                 among_bodies = lengthOf(apart) * step_ + turned;
    const auto meets = [&](double way, double side, double thin) {
      if (side < infinity && way >= (body.thin + side) / 2) note(fast, way / thin, way / thin);
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
  double contacts = 0, pairs = 0, touching = 0, idle = 0;
  std::set<dBodyID> others;
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
      others.insert(with);
      ++contacts;
      Body* const other = find(with);
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
    pairs += static_cast<double>(others.size());
    bearers += below.size();
    for (Body* other : below)
      other->carried += (body->mass + body->carried) / static_cast<double>(bearers);
    noteCarried(*body, heaviest);
    ++touching;
    idle += !dBodyGetAutoDisableFlag(body->id) &&
            lengthOf(dBodyGetLinearVel(body->id)) < gravity_ * step_ &&
            lengthOf(dBodyGetAngularVel(body->id)) * body->size < 2 * gravity_ * step_;
  }
  if (pairs > 0) note(many_contacts, contacts / pairs, contacts / pairs);
  if (idle >= least_idle) note(restless, idle / touching, 100 * idle / touching);
}

void Physics::noteCarried(const Body& body, double heaviest) {
  const double fall = fall_ / body.size, ratio = heaviest / body.mass;
  const double times = body.carried / body.mass;
  const double cfm = number(dWorldGetCFM(world_)), erp = number(dWorldGetERP(world_));
  if (ratio >= least_ratio) note(mass_ratio, ratio * fall, ratio);
  const bool is_soft = cfm * body.mass >= soft_share && erp >= 0.8;
  const double usual = table[load].limit;
  const double most = !isBuilt(body) ? heap_falls : is_soft ? soft_falls : usual;
  if (times >= 0.5) note(load, (1 + times) * fall * usual / most, times);
  note(small_body, fall, 100 * fall);
  // By so much a contact gives that bears it all.
  const double sink = cfm * step_ * (body.mass + body.carried) * gravity_ / erp / body.size;
  note(soft, sink, 100 * sink);
  const dReal* const at = dBodyGetPosition(body.id);
  const double spacing = number(std::numeric_limits<dReal>::epsilon()) * lengthOf(at) / body.size;
  note(far_away, spacing, lengthOf(at));
}

// What hangs on each body by joints, from the farthest from the world on.
void Physics::noteJoints() {
  std::vector<Body*> order;
  const auto forLinks = [this](Body* body, auto use) {
    forJoints(body->id, [&](dJointID joint, dBodyID with) {
      if (!isContact(joint)) use(find(with));
    });
  };
  for (auto& [id, body] : bodies_) {
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
    if (times >= 0.5) note(hanging, (1 + times) * fall_ / body->size, times);
  }
}

// Bodies with three different moments of inertia that nothing touches. Under gravity something soon
// will.
void Physics::noteTurning() {
  for (const auto& [id, body] : bodies_) {
    if (body.touches || body.jointed || (gravity_ > 0 && dBodyGetGravityMode(body.id))) continue;
    dMass mass;
    dBodyGetMass(body.id, &mass);
    std::array<double, 3> inertia = {number(mass.I[0]), number(mass.I[5]), number(mass.I[10])};
    std::sort(inertia.begin(), inertia.end());
    const double angle = lengthOf(dBodyGetAngularVel(body.id)) * step_;
    if (inertia[1] > 1.01 * inertia[0] && inertia[2] > 1.01 * inertia[1])
      note(turning, angle, angle);
  }
}

void Physics::note(Regime regime, double measure, double number) {
  const double excess = measure / table[regime].limit;
  if (excess > worst_[regime].excess) worst_[regime] = {excess, number};
}

void Physics::add(const Physics& other) {
  for (std::size_t i = 0; i < regimes; ++i)
    if (other.worst_[i].excess > worst_[i].excess) worst_[i] = other.worst_[i];
}

std::vector<std::string> Physics::lines() const {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < regimes; ++i) {
    if (worst_[i].excess < 1) continue;
    char line[192];
    std::snprintf(line, sizeof line, table[i].text, worst_[i].number);
    all.emplace_back(line);
  }
  return all;
}

}  // namespace ode_parallel_sap
