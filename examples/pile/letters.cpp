#include "letters.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "letter_outlines.h"

namespace pile {
namespace {

// A letter with n outline points and h holes has 2 (n + 2h - 2) triangles on its two faces and 2 n
// on its sides. With 8 holes in the alphabet (A, B twice, D, O, P, Q, R), 3,168 triangles for 26
// letters take this many points.
constexpr int points_in_alphabet = 3168 / 4 + letter_count - 8;

struct Variation {
  double size;
  double stroke;
  double slant;
  double depth;
};

Variation variationOf(int index) {
  const int v = index % letter_variation_count;
  return {0.8 + 0.05 * v, 0.14 + 0.009 * (3 * v % 10), 0.1 * (v % 5 - 2),
          0.22 + 0.02 * (7 * v % 10)};
}

int pointCount(const Region& region) {
  return std::accumulate(region.begin(), region.end(), 0, [](int sum, const Loop& loop) {
    return sum + static_cast<int>(loop.size());
  });
}

// How many points each letter gets: what its outline needs, then one more at a time for the letter
// that has the fewest, up to the alphabet's sum. The same for all variations.
std::vector<int> pointBudget() {
  std::vector<int> budget;
  for (int letter = 0; letter < letter_count; ++letter)
    budget.push_back(pointCount(letterOutline(letter, variationOf(0).stroke)));
  int left = points_in_alphabet - std::accumulate(budget.begin(), budget.end(), 0);
  for (; left > 0; --left) ++*std::min_element(budget.begin(), budget.end());
  return budget;
}

void splitLongestEdge(Region& region) {
  double longest = 0;
  Loop* loop_found = nullptr;
  size_t edge = 0;
  for (Loop& loop : region)
    for (size_t i = 0; i < loop.size(); ++i) {
      const Point2& a = loop[i];
      const Point2& b = loop[(i + 1) % loop.size()];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      if (length > longest * 1.000001) {
        longest = length;
        loop_found = &loop;
        edge = i;
      }
    }
  const Point2 a = (*loop_found)[edge];
  const Point2 b = (*loop_found)[(edge + 1) % loop_found->size()];
  loop_found->insert(loop_found->begin() + static_cast<std::ptrdiff_t>(edge) + 1,
                     {0.5 * (a.x + b.x), 0.5 * (a.y + b.y)});
}

Mesh extrude(const Region& region, const Variation& variation) {
  Mesh mesh;
  const int n = pointCount(region);
  for (const double side : {0.5, -0.5})
    for (const Loop& loop : region)
      for (const Point2& p : loop)
        mesh.points.push_back({static_cast<float>(variation.size * (p.x + variation.slant * p.y)),
                               static_cast<float>(variation.size * p.y),
                               static_cast<float>(variation.depth * side)});
  const auto add = [&](int a, int b, int c) {
    mesh.triangles.push_back(
        {static_cast<dTriIndex>(a), static_cast<dTriIndex>(b), static_cast<dTriIndex>(c)});
  };
  for (const IndexTriangle& t : triangulate(region)) {
    add(t[0], t[1], t[2]);
    add(n + t[0], n + t[2], n + t[1]);
  }
  int first = 0;
  for (const Loop& loop : region) {
    const int size = static_cast<int>(loop.size());
    for (int i = 0; i < size; ++i) {
      const int a = first + i;
      const int b = first + (i + 1) % size;
      add(a, n + a, n + b);
      add(a, n + b, b);
    }
    first += size;
  }
  return mesh;
}

}  // namespace

Mesh makeLetter(int letter, int variation) {
  static const std::vector<int> budget = pointBudget();
  const Variation look = variationOf(variation);
  Region region = letterOutline(letter, look.stroke);
  while (pointCount(region) < budget[letter]) splitLongestEdge(region);
  return extrude(region, look);
}

}  // namespace pile
