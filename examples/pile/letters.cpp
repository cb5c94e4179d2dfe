#include "letters.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

namespace pile {
namespace {

struct Point2 {
  double x, y;
};
using Line = std::vector<Point2>;

constexpr double degree = 0.017453292519943295;

Line arc(Point2 centre, double rx, double ry, double from, double to) {
  constexpr int pieces = 24;  // so that the alphabet has its number of triangles
  Line points;
  for (int i = 0; i <= pieces; ++i) {
    const double angle = degree * (from + (to - from) * i / pieces);
    points.push_back({centre.x + rx * std::cos(angle), centre.y + ry * std::sin(angle)});
  }
  return points;
}

Line join(std::initializer_list<Line> parts) {
  Line all;
  for (const Line& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// The bowl of B, D, P and R.
Line bowl(double low, double high) {
  return join(
      {{{0, high}}, arc({0.3, (low + high) / 2}, 0.35, (high - low) / 2, 90, -90), {{0, low}}});
}

// The middle lines of a letter's strokes: one unit high, before the pen's width.
const std::vector<Line>& strokesOf(int letter) {
  const Line stem = {{0, 0}, {0, 1}}, ring = arc({0.4, 0.5}, 0.4, 0.5, 0, 360);
  static const std::vector<Line> alphabet[letter_count] = {
      {{{0, 0}, {0.4, 1}, {0.8, 0}}, {{0.16, 0.4}, {0.64, 0.4}}},                             // A
      {stem, bowl(0.5, 1), bowl(0, 0.5)},                                                     // B
      {arc({0.4, 0.5}, 0.4, 0.5, 50, 310)},                                                   // C
      {stem, bowl(0, 1)},                                                                     // D
      {{{0.6, 1}, {0, 1}, {0, 0}, {0.6, 0}}, {{0, 0.5}, {0.5, 0.5}}},                         // E
      {{{0.6, 1}, {0, 1}, {0, 0}}, {{0, 0.5}, {0.5, 0.5}}},                                   // F
      {join({arc({0.4, 0.5}, 0.4, 0.5, 50, 350), {{0.45, 0.42}}})},                           // G
      {stem, {{0.7, 0}, {0.7, 1}}, {{0, 0.5}, {0.7, 0.5}}},                                   // H
      {stem},                                                                                 // I
      {join({{{0.5, 1}}, arc({0.25, 0.25}, 0.25, 0.25, 0, -170)})},                           // J
      {stem, {{0.65, 1}, {0.1, 0.5}, {0.65, 0}}},                                             // K
      {{{0, 1}, {0, 0}, {0.6, 0}}},                                                           // L
      {{{0, 0}, {0, 1}, {0.4, 0.4}, {0.8, 1}, {0.8, 0}}},                                     // M
      {{{0, 0}, {0, 1}, {0.7, 0}, {0.7, 1}}},                                                 // N
      {ring},                                                                                 // O
      {stem, bowl(0.5, 1)},                                                                   // P
      {ring, {{0.5, 0.3}, {0.8, 0}}},                                                         // Q
      {stem, bowl(0.5, 1), {{0.3, 0.5}, {0.65, 0}}},                                          // R
      {join({arc({0.3, 0.75}, 0.3, 0.25, 20, 255), arc({0.3, 0.25}, 0.3, 0.25, 75, -160)})},  // S
      {{{0.35, 0}, {0.35, 1}}, {{0, 1}, {0.7, 1}}},                                           // T
      {join({{{0, 1}}, arc({0.35, 0.35}, 0.35, 0.35, 180, 360), {{0.7, 1}}})},                // U
      {{{0, 1}, {0.38, 0}, {0.76, 1}}},                                                       // V
      {{{0, 1}, {0.25, 0}, {0.5, 0.75}, {0.75, 0}, {1, 1}}},                                  // W
      {{{0, 0}, {0.7, 1}}, {{0, 1}, {0.7, 0}}},                                               // X
      {{{0, 1}, {0.38, 0.45}, {0.76, 1}}, {{0.38, 0.45}, {0.38, 0}}},                         // Y
      {{{0, 1}, {0.65, 1}, {0, 0}, {0.65, 0}}}};                                              // Z
  return alphabet[letter];
}

struct Variation {
  double size, stroke, slant, depth;
};

Variation variationOf(int v) {
  return {0.8 + 0.05 * v, 0.14 + 0.009 * (3 * v % 10), 0.1 * (v % 5 - 2),
          0.22 + 0.02 * (7 * v % 10)};
}

Point2 leftOf(const Point2& a, const Point2& b) {
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  return {(a.y - b.y) / length, (b.x - a.x) / length};
}

// From the middle of a stroke to its left side. Corners are mitred, sharp ones no further than 0.8
// widths from the line.
Point2 sideAt(const Line& line, size_t i, double width) {
  const size_t last = line.size() - 1;
  const Point2 before = leftOf(line[i ? i - 1 : 0], line[i ? i : 1]);
  const Point2 after = i == last ? before : leftOf(line[i], line[i + 1]);
  const Point2 both = {before.x + after.x, before.y + after.y};
  const double length = std::hypot(both.x, both.y);
  const double reach = std::min(0.8 * width, width / length) / length;
  return {both.x * reach, both.y * reach};
}

// Adds a closed bar along the line: four points at each of the line's.
void addStroke(Mesh& mesh, const Line& line, const Variation& look) {
  const auto first = static_cast<dTriIndex>(mesh.points.size());
  const auto quad = [&](dTriIndex a, dTriIndex b, dTriIndex c, dTriIndex d) {
    mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.triangles.push_back({first + a, first + c, first + d});
  };
  for (size_t i = 0; i < line.size(); ++i) {
    const Point2 side = sideAt(line, i, look.stroke);
    constexpr int corners[4][2] = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
    for (const auto& [left, front] : corners) {
      const double x = line[i].x + left * side.x, y = line[i].y + left * side.y;
      mesh.points.push_back({static_cast<float>(look.size * (x + look.slant * y)),
                             static_cast<float>(look.size * y),
                             static_cast<float>(0.5 * look.depth * front)});
    }
  }
  const auto end = static_cast<dTriIndex>(4 * (line.size() - 1));
  for (dTriIndex i = 0; i < end; i += 4)
    for (dTriIndex k = 0; k < 4; ++k) quad(i + k, i + 4 + k, i + 4 + (k + 1) % 4, i + (k + 1) % 4);
  quad(0, 1, 2, 3);
  quad(end, end + 3, end + 2, end + 1);
}

}  // namespace

Mesh makeLetter(int letter, int variation) {
  Mesh mesh;
  for (const Line& line : strokesOf(letter)) addStroke(mesh, line, variationOf(variation));
  return mesh;
}

}  // namespace pile
