#include "space/contacts/reducers.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ode_parallel_sap {

namespace {

// fixed: hulls of more corners than this do not grow any more. Four hold a face of a box.
constexpr int most_corners = 64;

bool isDeeper(const dContactGeom& a, const dContactGeom& b) {
  return a.depth > b.depth || (a.depth == a.depth && b.depth != b.depth);
}

// Of [begin, end), which is not empty: the first for which no other is better.
template <class IsBetter>
int bestOf(int begin, int end, IsBetter is_better) {
  int best = begin;
  for (int i = begin + 1; i < end; ++i)
    if (is_better(i, best)) best = i;
  return best;
}

// Puts contact `chosen` at `place`, before those that it overtakes.
void choose(dContactGeom* contacts, int place, int chosen) {
  std::rotate(contacts + place, contacts + chosen, contacts + chosen + 1);
}

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

// A convex polygon, corners anticlockwise, that grows; a line or a point to begin with.
class Hull {
 public:
  // Twice the area that a point would add; 0 for one within and for what is no number.
  double gainOf(const View::Point& point) const {
    double gain = 0;
    for (int i = 0; i < count_; ++i) gain += std::max(beyond(i, point), 0.0);
    return gain < std::numeric_limits<double>::infinity() ? gain : 0;
  }

  // A point that adds area, or one of the first two.
  void add(const View::Point& point) {
    if (count_ == most_corners) return;
    if (count_ < 2) {
      corners_[count_++] = point;
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

}  // namespace

int keepDeepest(dContactGeom* contacts, int count, int most) {
  const int kept = std::min(count, most);
  for (int place = 0; place < kept; ++place)
    choose(contacts, place,
           bestOf(place, count, [&](int i, int j) { return isDeeper(contacts[i], contacts[j]); }));
  return kept;
}

int keepSpread(dContactGeom* contacts, int count, int most) {
  const int kept = std::min(count, most);
  if (kept < 1) return 0;
  keepDeepest(contacts, count, 1);
  if (kept == 1) return 1;
  const auto isFarther = [&](int i, int j) {
    return squareDistance(contacts[i], contacts[0]) > squareDistance(contacts[j], contacts[0]);
  };
  choose(contacts, 1, bestOf(1, count, isFarther));
  const View view(contacts[0].normal, contacts[0].pos);
  Hull hull;
  hull.add(view.of(contacts[0]));
  hull.add(view.of(contacts[1]));
  for (int place = 2; place < kept; ++place) {
    const auto gain = [&](int i) { return hull.gainOf(view.of(contacts[i])); };
    int best = place;
    double best_gain = gain(place);
    for (int i = place + 1; i < count; ++i) {
      const double other = gain(i);
      if (other > best_gain ||
          (other == best_gain && best_gain == 0 && isDeeper(contacts[i], contacts[best]))) {
        best = i;
        best_gain = other;
      }
    }
    choose(contacts, place, best);
    if (best_gain > 0) hull.add(view.of(contacts[place]));
  }
  return kept;
}

}  // namespace ode_parallel_sap
