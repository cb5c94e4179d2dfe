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
constexpr int most_seen = 32;            // fixed: contacts of a place
constexpr int most_walls = 3;            // fixed: that meet in a corner
constexpr dReal deeper = dReal(1) / 32;  // sides; to where faces touch, and not only a corner

constexpr dReal infinity = std::numeric_limits<dReal>::infinity();

// A geom on the way on which its body's velocities carry it, in the end back where it lay. Only the
// geom is moved, so that the space, which may be locked, learns of nothing.
class Traveller {
 public:
  Traveller(dxGeom* geom, dReal step) : geom_(geom), step_(step) {
    if (!geom->body) return;
    dBodyCopyPosition(geom->body, centre_);
    if (!dBodyIsEnabled(geom->body)) return;
    dCopyScaledVector3(shift_, dBodyGetLinearVel(geom->body), step);
    dCopyScaledVector3(turn_, dBodyGetAngularVel(geom->body), step);
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
  // By which gravity changes its shift.
  dReal fall() const {
    if (!home_ || !dBodyGetGravityMode(geom_->body)) return 0;
    dVector3 gravity;
    dWorldGetGravity(dBodyGetWorld(geom_->body), gravity);
    return dCalcVectorLength3(gravity) * step_ * step_;
  }
  // Bends its way, and makes it what its body's velocity says.
  void shiftMore(dReal by, const dReal* direction) {
    dAddVectorScaledVector3(shift_, shift_, direction, by);
  }
  void straighten() {
    if (home_) dCopyScaledVector3(shift_, dBodyGetLinearVel(geom_->body), step_);
  }
  dxGeom* geom() const { return geom_; }
  bool moves() const { return home_ != nullptr; }
  const dReal* centre() const { return centre_; }  // of its body, now
  const dReal* shift() const { return shift_; }
  dReal turned() const { return turned_; }      // by its farthest point
  dReal smallest() const { return smallest_; }  // side; endless of one that does not move
  // Whether its body answers to contacts.
  bool answers() const { return geom_->body && !dBodyIsKinematic(geom_->body); }

 private:
  void lie(dxPosR* where) {
    geom_->final_posr = where;
    geom_->gflags |= GEOM_AABB_BAD;
    updateAABB(geom_);
  }

  dxGeom* const geom_;
  const dReal step_;
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
  dMass masses[2];
  dVector3 between, relative, moments[2], torque, away, blow;
  for (int i : {0, 1}) {
    dVector3 arm;
    dBodyGetMass(both[i]->geom()->body, &masses[i]);
    both[i]->armTo(contact.pos, arm);
    dCalcVectorCross3(moments[i], arm, contact.normal);
  }
  dSubtractVectors3(between, other.centre(), one.centre());
  dSubtractVectors3(relative, one.shift(), other.shift());
  dCalcVectorCross3(torque, relative, contact.normal);
  dCalcVectorCross3(away, torque, between);
  const bool lighter = masses[1].mass < masses[0].mass;
  const dMass &light = masses[lighter], &heavy = masses[!lighter];
  const dReal inertia = (heavy.I[0] + heavy.I[5] + heavy.I[10]) / 3;  // the mean of its axes
  const dReal divisor =
      dCalcVectorLengthSquare3(between) + inertia * heavy.mass / (10 * light.mass * light.mass);
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

// Two geoms on their ways, and the contacts of dCollide that they have there.
struct SweptPair {
  Traveller one, other;
  const int flags;
  dContactGeom* const contacts;
  const int skip;
  const dReal smallest = std::min(one.smallest(), other.smallest());  // side of one that moves
  // A ball that rolls sinks by this between steps. So it touches the edges of tiles ahead, with
  // which the next steps deal.
  dReal least = std::min(4 * std::max(one.fall(), other.fall()), smallest* deeper);
  int touching = 0;  // contacts at the beginning

  // Returns their number.
  int collide() {
    touching = collideNow();
    int count = strike(0);
    if (count == 0) return isFast() ? collideNow() : touching;
    // From the first wall of a mesh on along it, since others are in no other pair.
    for (int walls = 1, first = 0; walls < most_walls && slideAlong(contactAt(first)); ++walls) {
      first = count;
      count = strike(first);
      if (count == first) break;
    }
    one.straighten();
    other.straighten();
    if (touching)
      count = collideAt(0, count, [this](const dContactGeom& contact) { return isSlow(contact); });
    return count;
  }

  dContactGeom& contactAt(int i) const {
    return *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) + i * skip);
  }
  // Those of dCollide there.
  int collideAt(dReal part, int most, dContactGeom* to, int stride) {
    one.advance(part);
    other.advance(part);
    return collideInTurn(one.geom(), other.geom(), most, to, stride);
  }
  int collideNow() { return collideAt(0, flags, contacts, skip); }
  // Adds those for which isOne() to the first ones, as far as there is room. It sees more than have
  // room: floors come first.
  template <class IsOne>
  int collideAt(dReal part, int first, const IsOne& isOne) {
    dContactGeom seen[most_seen];
    const int number = collideAt(part, (flags & ~NUMC_MASK) | most_seen, seen, sizeof *seen);
    int count = first;
    for (int i = 0; i < number && count < (flags & NUMC_MASK); ++i)
      if (isOne(seen[i])) contactAt(count++) = seen[i];
    return count;
  }

  // Of their relative way.
  dReal length() const {
    return dCalcPointsDistance3(one.shift(), other.shift()) + one.turned() + other.turned();
  }
  bool isFast() const {
    const dReal way = length();
    return 2 * way > smallest && way < infinity;
  }
  // How far the two come apart along a contact's normal: by their shifts alone, and in all.
  dReal shiftsApart(const dContactGeom& contact) const {
    dVector3 shift;
    dSubtractVectors3(shift, one.shift(), other.shift());
    return dCalcVectorDot3(contact.normal, shift);
  }
  dReal comesApart(const dContactGeom& contact) const {
    dVector3 arms[2];
    one.armTo(contact.pos, arms[0]);
    other.armTo(contact.pos, arms[1]);
    return one.moveAlong(contact.normal, arms[0]) - other.moveAlong(contact.normal, arms[1]);
  }
  bool isSlow(const dContactGeom& contact) const { return -2 * comesApart(contact) <= smallest; }

  // Adds the contacts where they first strike each other on their way.
  int strike(int first) {
    if (!isFast()) return first;
    // The floor on which a body rolls may be one mesh with the wall ahead.
    const auto does = [this](const dContactGeom& contact) {
      return contact.depth > least && !(touching && isSlow(contact));
    };
    const dReal wanted = std::ceil(4 * length() / smallest);
    const int places = static_cast<int>(std::min(wanted, dReal(most_places)));
    int count = first, place = -1;
    while (count == first && place < places)
      count = collideAt(dReal(++place) / dReal(places), first, does);
    if (count == first) return first;
    dReal part = dReal(place) / dReal(places), apart = part - 1 / dReal(places);
    for (int i = 0; place > 0 && i < halvings; ++i) {
      const dReal middle = (apart + part) / 2;
      (collideAt(middle, first, does) > first ? part : apart) = middle;
    }
    const dReal further = part + deeper * smallest / length();
    count = collideAt(further, first, does);
    if (count > first)
      part = further;
    else
      count = collideAt(part, first, does);
    for (int i = first; i < count; ++i) {
      foretell(part, contactAt(i));
      if (place > 0) contactAt(i).depth = std::min(contactAt(i).depth, dReal(0));
    }
    return count;
  }

  // Makes a contact after a part of the step one for a joint that is made now.
  void foretell(dReal part, dContactGeom& contact) const {
    if (one.answers() && other.answers()) return meetInFlight(one, other, part, smallest, contact);
    const Traveller& body = other.answers() ? other : one;
    const dReal shift = shiftsApart(contact);
    const bool shifts = -2 * shift > smallest;
    dVector3 arm;
    body.armTo(contact.pos, arm);
    contact.depth += part * (shifts ? shift : comesApart(contact));
    // A fast body stops by a force through its centre: with a lever it would go on and turn by
    // radians. Friction has the lever of a ball.
    const dReal along = dCalcVectorDot3(arm, contact.normal);
    for (int k = 0; k < 3; ++k)
      contact.pos[k] = body.centre()[k] + (shifts ? along * contact.normal[k] : arm[k]);
  }

  // Bends the way from one to the other, so that it ends where the contact's motion does. False
  // where there is no such way.
  bool slideAlong(const dContactGeom& contact) {
    if (one.answers() == other.answers()) return false;
    const dReal too_far = contact.depth - shiftsApart(contact);
    if (!(too_far > 0 && -2 * shiftsApart(contact) > smallest)) return false;
    least = deeper * smallest;  // at the wall
    one.moves() ? one.shiftMore(too_far, contact.normal)
                : other.shiftMore(-too_far, contact.normal);
    return true;
  }
};

}  // namespace

int collideSwept(dxGeom* a, dxGeom* b, dReal step, int flags, dContactGeom* contacts, int skip) {
  return SweptPair{{a, step}, {b, step}, flags, contacts, skip}.collide();
}

}  // namespace ode_parallel_sap
