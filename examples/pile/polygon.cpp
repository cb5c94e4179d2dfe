#include "polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace pile {
namespace {

// Twice the area of a, b, c; positive if they turn to the left.
double turn(const Point2& a, const Point2& b, const Point2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// Letters are about 1 long: this is far below any real corner and far above rounding.
constexpr double flat = 1e-9;

bool same(const Point2& a, const Point2& b) {
  return a.x == b.x && a.y == b.y;
}

double distance(const Point2& a, const Point2& b) {
  return std::hypot(b.x - a.x, b.y - a.y);
}

class EarClipper {
 public:
  explicit EarClipper(const Region& region) {
    std::vector<std::vector<int>> loops;
    for (const Loop& loop : region) {
      loops.emplace_back();
      for (const Point2& point : loop) {
        loops.back().push_back(static_cast<int>(points_.size()));
        points_.push_back(point);
      }
    }
    ring_ = loops.front();
    for (size_t hole = 1; hole < loops.size(); ++hole) joinHole(loops, hole);
  }

  std::vector<IndexTriangle> run() {
    std::vector<IndexTriangle> triangles;
    while (ring_.size() > 3) {
      const size_t ear = bestEar();
      triangles.push_back(cornerAt(ear));
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back(cornerAt(1));
    for (const IndexTriangle& t : triangles)
      if (turn(points_[t[0]], points_[t[1]], points_[t[2]]) <= flat)
        throw std::logic_error("a region cannot be cut into triangles");
    return triangles;
  }

 private:
  IndexTriangle cornerAt(size_t i) const {
    const size_t n = ring_.size();
    return {ring_[(i + n - 1) % n], ring_[i], ring_[(i + 1) % n]};
  }

  // The shortest bridge from the hole to the ring that crosses nothing makes the two one ring.
  void joinHole(const std::vector<std::vector<int>>& loops, size_t hole_index) {
    const std::vector<int>& hole = loops[hole_index];
    double best = std::numeric_limits<double>::infinity();
    size_t at_ring = 0;
    size_t at_hole = 0;
    for (size_t i = 0; i < ring_.size(); ++i)
      for (size_t j = 0; j < hole.size(); ++j) {
        const double length = distance(points_[ring_[i]], points_[hole[j]]);
        if (length < best && bridgeIsFree(ring_[i], hole[j], loops, hole_index)) {
          best = length;
          at_ring = i;
          at_hole = j;
        }
      }
    if (std::isinf(best)) throw std::logic_error("a hole cannot be joined to its outline");
    std::vector<int> bridge(hole.begin() + static_cast<std::ptrdiff_t>(at_hole), hole.end());
    bridge.insert(bridge.end(), hole.begin(),
                  hole.begin() + static_cast<std::ptrdiff_t>(at_hole) + 1);
    bridge.push_back(ring_[at_ring]);
    ring_.insert(ring_.begin() + static_cast<std::ptrdiff_t>(at_ring) + 1, bridge.begin(),
                 bridge.end());
  }

  bool bridgeIsFree(int from, int to, const std::vector<std::vector<int>>& loops,
                    size_t hole_index) const {
    if (crossesEdge(from, to, ring_)) return false;
    for (size_t i = hole_index; i < loops.size(); ++i)
      if (crossesEdge(from, to, loops[i])) return false;
    return true;
  }

  bool crossesEdge(int from, int to, const std::vector<int>& loop) const {
    const Point2& a = points_[from];
    const Point2& b = points_[to];
    for (size_t i = 0; i < loop.size(); ++i) {
      const Point2& c = points_[loop[i]];
      const Point2& d = points_[loop[(i + 1) % loop.size()]];
      if (same(a, c) || same(a, d) || same(b, c) || same(b, d)) continue;
      if (turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0) return true;
    }
    return false;
  }

  // Of the corners that can be cut off, the one with the roundest triangle.
  size_t bestEar() const {
    double best = 0;
    size_t ear = ring_.size();
    for (size_t i = 0; i < ring_.size(); ++i) {
      const IndexTriangle corner = cornerAt(i);
      const double quality = roundness(corner);
      if (quality > best && isEmpty(corner)) {
        best = quality;
        ear = i;
      }
    }
    if (ear == ring_.size()) throw std::logic_error("a region cannot be cut into triangles");
    return ear;
  }

  // Area over squared perimeter; 0 for a corner that is flat or turns to the right.
  double roundness(const IndexTriangle& t) const {
    const Point2& a = points_[t[0]];
    const Point2& b = points_[t[1]];
    const Point2& c = points_[t[2]];
    const double area = turn(a, b, c);
    if (area <= flat) return 0;
    const double perimeter = distance(a, b) + distance(b, c) + distance(c, a);
    return area / (perimeter * perimeter);
  }

  // No other point inside or on the border: one on the border would be left over as a flat corner.
  bool isEmpty(const IndexTriangle& t) const {
    const Point2& a = points_[t[0]];
    const Point2& b = points_[t[1]];
    const Point2& c = points_[t[2]];
    return std::none_of(ring_.begin(), ring_.end(), [&](int index) {
      const Point2& p = points_[index];
      if (same(p, a) || same(p, b) || same(p, c)) return false;
      return turn(a, b, p) >= -flat && turn(b, c, p) >= -flat && turn(c, a, p) >= -flat;
    });
  }

  std::vector<Point2> points_;
  std::vector<int> ring_;
};

}  // namespace

std::vector<IndexTriangle> triangulate(const Region& region) {
  return EarClipper(region).run();
}

}  // namespace pile
