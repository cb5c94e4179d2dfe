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
  // How far a point of its body would move in the step along a direction, from where it is.
  dReal moveAlong(const dReal* direction, const dReal* point) const {
    if (!home_) return 0;
    dVector3 arm, move;
    for (int i = 0; i < 3; ++i) arm[i] = point[i] - centre_[i] - part_ * shift_[i];
    dCalcVectorCross3(move, turn_, arm);
    dAddVectors3(move, move, shift_);
    return dCalcVectorDot3(move, direction);
  }
  const dReal* centre() const { return centre_; }  // of its body, now
  const dReal* shift() const { return shift_; }
  dReal turned() const { return turned_; }      // by its farthest point
  dReal smallest() const { return smallest_; }  // side; endless of one that does not move
  dReal mass() const {
    dMass mass;
    if (!geom_->body || dBodyIsKinematic(geom_->body)) return infinity;
    dBodyGetMass(geom_->body, &mass);
    return mass.mass;
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
    return one.moveAlong(contact.normal, contact.pos) -
           other.moveAlong(contact.normal, contact.pos);
  };
  int count = collideAt(0), place = 0;
  bool slow = count > 0;
  for (int i = 0; i < count; ++i) slow = slow && -2 * comesBy(contactAt(i)) <= smallest;
  if (slow || !(2 * way > smallest && way < infinity)) return count;
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
  // One place cannot be right for the levers of two bodies: it is for the lighter one. Without a
  // lever a fast body stops, which would go on and turn by radians otherwise.
  const dReal mass = one.mass(), with = other.mass();
  const dReal share = with == infinity ? 1 : mass == infinity ? 0 : with / (mass + with);
  for (int i = 0; i < count; ++i) {
    dContactGeom& contact = contactAt(i);
    const dReal shift = dCalcVectorDot3(contact.normal, relative), all = comesBy(contact);
    const bool shifts = -2 * shift > smallest;
    contact.depth += part * (shifts ? shift : all);
    if (place > 0) contact.depth = std::min(contact.depth, dReal(0));
    for (int k = 0; k < 3; ++k)
      contact.pos[k] =
          shifts
              ? share * one.centre()[k] + (1 - share) * other.centre()[k]
              : contact.pos[k] - part * (share * one.shift()[k] + (1 - share) * other.shift()[k]);
  }
  return count;
}

}  // namespace ode_parallel_sap
