// Which contacts of a pair to keep: what reduce callbacks of dParallelSAPSpaceCollideContacts call.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "space/contacts/narrow_phase.h"

namespace ode_parallel_sap {

namespace {

// fixed: hulls of more corners than this do not grow any more. Four hold a face of a box.
constexpr int most_corners = 64;

// By what a contact is chosen: its rank, what it adds, its depth. Less is better.
using Order = std::tuple<int, double, double>;
Order orderOf(int rank, double gain, dReal depth = 0) {
  return {rank, -gain, -depth};
}

// Puts the first of the best contacts [place, count) at `place`, before those that it overtakes.
template <class OrderOf>
void chooseBest(dContactGeom* contacts, int place, int count, OrderOf order_of) {
  int best = place;
  Order best_order = order_of(contacts[place]);
  for (int i = place + 1; i < count; ++i) {
    const Order order = order_of(contacts[i]);
    if (!(order < best_order)) continue;
    best = i;
    best_order = order;
  }
  std::rotate(contacts + place, contacts + best, contacts + best + 1);
}

// ODE's colliders give contacts that lie beside their geoms, normals of 0, and depths and normals
// that are NaN. What is certain by a contact's numbers: a point of it lies no farther from an AABB
// of its geoms than it is deep.
class Ranks {
 public:
  Ranks(const dContactGeom* contacts, int count) {
    readBoxes(nullptr, nullptr);
    for (int i = 0; i < count; ++i) usable_ += of(contacts[i]) < unusable;
  }
  // The number of contacts that a joint can use.
  int usable() const { return usable_; }
  // Less is better.
  int of(const dContactGeom& contact) {
    const dReal* const normal = contact.normal;
    const bool has_normal = normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
    if (!has_normal || !isFinite(contact)) return unusable;
    if (contact.g1 != first_ || contact.g2 != second_) readBoxes(contact.g1, contact.g2);
    const dReal depth = std::max(contact.depth, dReal(0));
    for (int axis = 0; axis < 3; ++axis)
      if (contact.pos[axis] < low_[axis] - depth || contact.pos[axis] > high_[axis] + depth)
        return beside;
    return 0;
  }

 private:
  static constexpr int beside = 1, unusable = 2;

  // What both boxes have in common, with room for rounding.
  void readBoxes(dGeomID first, dGeomID second) {
    constexpr dReal infinity = std::numeric_limits<dReal>::infinity();
    constexpr dReal rounding = 4 * std::numeric_limits<dReal>::epsilon();
    std::fill_n(low_, 3, -infinity);
    std::fill_n(high_, 3, infinity);
    for (const dGeomID geom : {first_ = first, second_ = second}) {
      if (!geom) continue;
      dReal box[6];
      dGeomGetAABB(geom, box);
      const dReal room = std::max({box[1] - box[0], box[3] - box[2], box[5] - box[4]}) / 2048;
      for (int axis = 0; axis < 3; ++axis) {
        const dReal low = box[2 * axis], high = box[2 * axis + 1];
        low_[axis] = std::max(low_[axis], low - room - rounding * std::fabs(low));
        high_[axis] = std::min(high_[axis], high + room + rounding * std::fabs(high));
      }
    }
  }

  int usable_ = 0;
  dGeomID first_ = nullptr, second_ = nullptr;  // of these
  dReal low_[3], high_[3];
};

// Two axes across a normal, if it is one at all.
class View {
 public:
  struct Point {
    double x, y;
  };

  // Along `normal`, from `origin`.
  View(const dReal* normal, const dReal* origin) : origin_{origin[0], origin[1], origin[2]} {
    const double n[3] = {normal[0], normal[1], normal[2]};
    // Away from the axis that the normal is nearest to.
    int least = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (std::fabs(n[axis]) < std::fabs(n[least])) least = axis;
    double other[3] = {0, 0, 0};
    other[least] = 1;
    cross(n, other, across_);
    cross(n, across_, up_);
  }

  Point of(const dContactGeom& contact) const {
    Point point = {0, 0};
    for (int axis = 0; axis < 3; ++axis) {
      const double along = static_cast<double>(contact.pos[axis]) - origin_[axis];
      point.x += along * across_[axis];
      point.y += along * up_[axis];
    }
    return point;
  }

 private:
  static void cross(const double* a, const double* b, double* product) {
    for (int axis = 0; axis < 3; ++axis) {
      const int next = (axis + 1) % 3, last = (axis + 2) % 3;
      product[axis] = a[next] * b[last] - a[last] * b[next];
    }
  }

  double origin_[3], across_[3], up_[3];
};

double squareDistance(const View::Point& a, const View::Point& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

// A convex polygon, corners anticlockwise, that grows; a line or a point to begin with.
class Hull {
 public:
  // Twice the area that a point would add; 0 for one within and for what is no number.
  double gainOf(const View::Point& point) const {
    double gain = 0;
    for (int i = 0; i < count_; ++i) gain += std::max(beyond(i, point), 0.0);
    return gain < std::numeric_limits<double>::infinity() ? gain : 0;
  }

  // As long as all points are on a line, its ends are the corners.
  void add(const View::Point& point) {
    if (count_ == most_corners || !std::isfinite(point.x) || !std::isfinite(point.y)) return;
    if (count_ < 2) {
      if (count_ == 0 || squareDistance(point, corners_[0]) > 0) corners_[count_++] = point;
      return;
    }
    if (count_ == 2 && !(gainOf(point) > 0)) {
      const double length = squareDistance(corners_[0], corners_[1]);
      const double to[] = {squareDistance(corners_[0], point), squareDistance(corners_[1], point)};
      if (std::max(to[0], to[1]) > length) corners_[to[0] > to[1]] = point;
      return;
    }
    // The corners between edges that the point is beyond are corners no longer.
    int first = 0;
    while (first < count_ && !(beyond(first, point) > 0)) ++first;
    if (first == count_) return;
    while (first > 1 - count_ && beyond(first - 1, point) > 0) --first;
    int last = first;
    while (last + 1 < first + count_ && beyond(last + 1, point) > 0) ++last;
    View::Point grown[most_corners];
    int size = 0;
    grown[size++] = point;
    for (int i = last + 1; i <= first + count_; ++i) grown[size++] = corner(i);
    std::copy(grown, grown + size, corners_);
    count_ = size;
  }

 private:
  const View::Point& corner(int i) const { return corners_[((i % count_) + count_) % count_]; }

  // Twice the area of the triangle of a point and edge i, negative within.
  double beyond(int i, const View::Point& point) const {
    const View::Point &a = corner(i), &b = corner(i + 1);
    return (point.x - a.x) * (b.y - a.y) - (point.y - a.y) * (b.x - a.x);
  }

  View::Point corners_[most_corners];
  int count_ = 0;
};

double squareDistance(const dContactGeom& a, const dContactGeom& b) {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = static_cast<double>(a.pos[axis]) - static_cast<double>(b.pos[axis]);
    sum += along * along;
  }
  return sum < std::numeric_limits<double>::infinity() ? sum : 0;
}

void chooseDeepest(dContactGeom* contacts, int place, int count, Ranks& ranks) {
  chooseBest(contacts, place, count, [&](const dContactGeom& contact) {
    return orderOf(ranks.of(contact), 0, contact.depth);
  });
}

void check(const dContactGeom* contacts, int count, int most,
           const char* caller = __builtin_FUNCTION()) {
  require(count >= 0 && most >= 0, "negative number of contacts", caller);
  require(contacts || count == 0, "no contacts", caller);
}

}  // namespace
}  // namespace ode_parallel_sap

using namespace ode_parallel_sap;

int dParallelSAPKeepDeepest(dContactGeom* contacts, int count, int most) {
  check(contacts, count, most);
  Ranks ranks(contacts, count);
  const int kept = std::min(ranks.usable(), most);
  for (int place = 0; place < kept; ++place) chooseDeepest(contacts, place, count, ranks);
  return kept;
}

int dParallelSAPKeepSpread(dContactGeom* contacts, int count, int most) {
  check(contacts, count, most);
  Ranks ranks(contacts, count);
  const int kept = std::min(ranks.usable(), most);
  if (kept < 1) return 0;
  chooseDeepest(contacts, 0, count, ranks);
  if (kept == 1) return 1;
  chooseBest(contacts, 1, count, [&](const dContactGeom& contact) {
    return orderOf(ranks.of(contact), squareDistance(contact, contacts[0]));
  });
  const View view(contacts[0].normal, contacts[0].pos);
  Hull hull;
  hull.add(view.of(contacts[0]));
  hull.add(view.of(contacts[1]));
  for (int place = 2; place < kept; ++place) {
    chooseBest(contacts, place, count, [&](const dContactGeom& contact) {
      const double gain = hull.gainOf(view.of(contact));
      return orderOf(ranks.of(contact), gain, gain > 0 ? 0 : contact.depth);
    });
    hull.add(view.of(contacts[place]));
  }
  return kept;
}
