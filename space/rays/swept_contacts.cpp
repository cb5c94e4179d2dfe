#include "space/rays/swept_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "space/contacts/collider_threads.h"
#include "space/geoms/geom_sides.h"
#include "space/geoms/geom_tests.h"

namespace ode_parallel_sap {

namespace {

constexpr int most_places = 1000;        // fixed: of a step, as the header says
constexpr int halvings = 4;              // fixed: of the way between two places
constexpr dReal deeper = dReal(1) / 32;  // sides; to where faces touch, and not only a corner

constexpr dReal infinity = std::numeric_limits<dReal>::infinity();

// A geom on the way on which its body's velocities carry it, in the end back where it lay. Only the
// geom is moved, so that the space, which may be locked, learns of nothing.
class Traveller {
 public:
  Traveller(dxGeom* geom, dReal step) : geom_(geom) {
    if (!geom->body) return;
    dBodyCopyPosition(geom->body, centre_);
    if (!dBodyIsEnabled(geom->body)) return;
    for (int i = 0; i < 3; ++i) {
      shift_[i] = dBodyGetLinearVel(geom->body)[i] * step;
      turn_[i] = dBodyGetAngularVel(geom->body)[i] * step;
    }
    if (dCalcVectorLengthSquare3(shift_) + dCalcVectorLengthSquare3(turn_) == 0) return;
    geom->recomputePosr();
    home_ = geom->final_posr;
    flags_ = geom->gflags;
    std::copy_n(geom->aabb, 6, aabb_);
    lie(home_);  // its AABB may be a swept one
    smallest_ = smallestSide(geom);
    turned_ = dCalcVectorLength3(turn_) * armOf(geom);
  }
  ~Traveller() {
    if (!home_) return;
    lie(home_);
    geom_->gflags = flags_;
    std::copy_n(aabb_, 6, geom_->aabb);
  }
  Traveller(const Traveller&) = delete;
  Traveller& operator=(const Traveller&) = delete;

  // To where it is after a part of the step.
  void advance(dReal part) {
    part_ = part;
    if (!home_) return;
    dVector3 arm, turned;
    dMatrix3 by;
    dRFromAxisAndAngle(by, turn_[0], turn_[1], turn_[2], part * dCalcVectorLength3(turn_));
    dSubtractVectors3(arm, home_->pos, centre_);
    dMultiply0_331(turned, by, arm);
    dMultiply0_333(away_.R, by, home_->R);
    for (int i = 0; i < 3; ++i) away_.pos[i] = centre_[i] + part * shift_[i] + turned[i];
    lie(part == 0 ? home_ : &away_);
  }
  // From its body's centre, where that is after the part of the step, to a point.
  void armTo(const dReal* point, dReal* arm) const {
    for (int i = 0; i < 3; ++i) arm[i] = point[i] - centre_[i] - part_ * shift_[i];
  }
  // How far such a point of its body would move in the step along a direction.
  dReal moveAlong(const dReal* direction, const dReal* arm) const {
    dVector3 move;
    dCalcVectorCross3(move, turn_, arm);
    dAddVectors3(move, move, shift_);
    return dCalcVectorDot3(move, direction);
  }
  const dReal* centre() const { return centre_; }  // of its body, now
  const dReal* shift() const { return shift_; }
  dReal turned() const { return turned_; }      // by its farthest point
  dReal smallest() const { return smallest_; }  // side; endless of one that does not move
  // Whether its body answers to contacts; and what it weighs, with the mean inertia of its axes.
  bool answers() const { return geom_->body && !dBodyIsKinematic(geom_->body); }
  struct Mass {
    dReal mass, inertia;
  };
  Mass mass() const {
    dMass mass;
    dBodyGetMass(geom_->body, &mass);
    return {mass.mass, (mass.I[0] + mass.I[5] + mass.I[10]) / 3};
  }

 private:
  void lie(dxPosR* where) {
    geom_->final_posr = where;
    geom_->gflags |= GEOM_AABB_BAD;
    updateAABB(geom_);
  }

  dxGeom* const geom_;
  dxPosR* home_ = nullptr;  // of one that moves
  dxPosR away_;
  dVector3 centre_ = {0, 0, 0, 0}, shift_ = {0, 0, 0, 0}, turn_ = {0, 0, 0, 0};
  dReal turned_ = 0, smallest_ = infinity, part_ = 0;
  int flags_ = 0;
  dReal aabb_[6];
};

// The contact of two free bodies that meet after a part of the step, for a joint that is made now.
// A joint applies one impulse along one line, but bodies whose centres are still apart need it
// along two. The impulse nearest to the normal n that gives both the right spin is n - ((w x n) x
// r) / r^2: r is the way from one centre to the other now, w their relative way until they meet.
// The second term of the divisor lets a much heavier body have a wrong spin instead.
void meetInFlight(const Traveller& one, const Traveller& other, dReal part, dReal smallest,
                  dContactGeom& contact) {
  const Traveller* const both[] = {&one, &other};
  const Traveller::Mass masses[] = {one.mass(), other.mass()};
  const bool lighter = masses[1].mass < masses[0].mass;
  const Traveller::Mass &light = masses[lighter], &heavy = masses[!lighter];
  dVector3 between, relative, moments[2], torque, away, blow;
  for (int i : {0, 1}) {
    dVector3 arm;
    both[i]->armTo(contact.pos, arm);
    dCalcVectorCross3(moments[i], arm, contact.normal);
  }
  dSubtractVectors3(between, other.centre(), one.centre());
  dSubtractVectors3(relative, one.shift(), other.shift());
  dCalcVectorCross3(torque, relative, contact.normal);
  dCalcVectorCross3(away, torque, between);
  const dReal divisor = dCalcVectorLengthSquare3(between) +
                        heavy.inertia * heavy.mass / (10 * light.mass * light.mass);
  for (int k = 0; k < 3; ++k) blow[k] = contact.normal[k] - part * away[k] / divisor;
  const dReal length = dCalcVectorLength3(blow);
  // Each body has a line of its own. The lighter one's counts for more.
  const dReal squares[] = {masses[0].mass * masses[0].mass, masses[1].mass * masses[1].mass};
  dVector3 lever, arms[2];
  dSetZero(contact.pos, 3);
  for (int i : {0, 1}) {
    dCalcVectorCross3(lever, blow, moments[i]);
    const dReal share = squares[!i] / (squares[0] + squares[1]);
    for (int k = 0; k < 3; ++k)
      contact.pos[k] += share * (both[i]->centre()[k] + lever[k] / (length * length));
  }
  for (int k = 0; k < 3; ++k) contact.normal[k] = blow[k] / length;
  for (int i : {0, 1}) dSubtractVectors3(arms[i], contact.pos, both[i]->centre());
  // They approach until they touch, and the next step does the rest, unless they would slide past
  // each other or turn by then.
  const dReal along = dCalcVectorDot3(relative, contact.normal);
  const dReal aside =
      std::sqrt(std::max(dCalcVectorLengthSquare3(relative) - along * along, dReal(0)));
  const dReal off =
      (1 - part) * aside + dCalcVectorLength3(moments[0]) + dCalcVectorLength3(moments[1]);
  contact.depth = 4 * off > smallest
                      ? dReal(0)
                      : contact.depth + part * (one.moveAlong(contact.normal, arms[0]) -
                                                other.moveAlong(contact.normal, arms[1]));
}

}  // namespace

int collideSwept(dxGeom* a, dxGeom* b, dReal step, int flags, dContactGeom* contacts, int skip) {
  Traveller one(a, step), other(b, step);
  const auto collideAt = [&](dReal part) {
    one.advance(part);
    other.advance(part);
    return collideInTurn(a, b, flags, contacts, skip);
  };
  dVector3 relative;
  dSubtractVectors3(relative, one.shift(), other.shift());
  const dReal way = dCalcVectorLength3(relative) + one.turned() + other.turned();
  const dReal smallest = std::min(one.smallest(), other.smallest());
  const auto contactAt = [&](int i) -> dContactGeom& {
    return *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) + i * skip);
  };
  // How far the two come apart along a contact's normal.
  const auto comesBy = [&](const dContactGeom& contact) {
    dVector3 arms[2];
    one.armTo(contact.pos, arms[0]);
    other.armTo(contact.pos, arms[1]);
    return one.moveAlong(contact.normal, arms[0]) - other.moveAlong(contact.normal, arms[1]);
  };
  const auto isSlow = [&](const dContactGeom& contact) {
    return -2 * comesBy(contact) <= smallest;
  };
  const auto all = [&](int count, const auto& property) {
    for (int i = 0; i < count; ++i)
      if (!property(contactAt(i))) return false;
    return count > 0;
  };
  int count = collideAt(0), place = 0;
  if (all(count, isSlow) || !(2 * way > smallest && way < infinity)) return count;
  const int places = static_cast<int>(std::min(std::ceil(4 * way / smallest), dReal(most_places)));
  while (count == 0 && place < places) count = collideAt(dReal(++place) / dReal(places));
  if (count == 0) return 0;
  dReal part = dReal(place) / dReal(places), apart = part - 1 / dReal(places);
  for (int i = 0; place > 0 && i < halvings; ++i) {
    const dReal middle = (apart + part) / 2;
    (collideAt(middle) ? part : apart) = middle;
  }
  const dReal further = part + deeper * smallest / way;
  count = collideAt(further);
  if (count > 0)
    part = further;
  else
    count = collideAt(part);
  const bool both = one.answers() && other.answers();
  // A ball that rolls from tile to tile touches the edge of the next one first. Where the step ends
  // in slow and shallow contacts, the next step deals with them; not where they are behind a wall.
  const auto isSlight = [&](const dContactGeom& contact) {
    return 2 * std::fabs(comesBy(contact)) <= smallest && contact.depth <= deeper * smallest;
  };
  if (place > 0 && !both) {
    if (all(collideAt(1), isSlight)) return 0;
    count = collideAt(part);
  }
  for (int i = 0; i < count; ++i) {
    dContactGeom& contact = contactAt(i);
    if (both) {
      meetInFlight(one, other, part, smallest, contact);
    } else {
      // Without a lever a fast body stops, which would go on and turn by radians otherwise.
      const Traveller& body = other.answers() ? other : one;
      const dReal shift = dCalcVectorDot3(contact.normal, relative);
      const bool shifts = -2 * shift > smallest;
      contact.depth += part * (shifts ? shift : comesBy(contact));
      for (int k = 0; k < 3; ++k)
        contact.pos[k] = shifts ? body.centre()[k] : contact.pos[k] - part * body.shift()[k];
    }
    if (place > 0) contact.depth = std::min(contact.depth, dReal(0));
  }
  return count;
}

}  // namespace ode_parallel_sap
