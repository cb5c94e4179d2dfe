#include "letter_outlines.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pile {
namespace {

constexpr double degree = 0.017453292519943295;

Loop arc(Point2 centre, double rx, double ry, double from, double to, int pieces) {
  Loop points;
  for (int i = 0; i <= pieces; ++i) {
    const double angle = degree * (from + (to - from) * i / pieces);
    points.push_back({centre.x + rx * std::cos(angle), centre.y + ry * std::sin(angle)});
  }
  return points;
}

Loop join(std::initializer_list<Loop> parts) {
  Loop all;
  for (const Loop& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

Loop ellipse(Point2 centre, double rx, double ry, int pieces) {
  Loop points = arc(centre, rx, ry, 0, 360, pieces);
  points.pop_back();
  return points;
}

Loop reversed(Loop loop) {
  std::reverse(loop.begin(), loop.end());
  return loop;
}

Point2 leftOf(const Point2& a, const Point2& b) {
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  return {(a.y - b.y) / length, (b.x - a.x) / length};
}

// The outline of a pen stroke along the line: down its right side, back up its left. Corners are
// mitred, sharp ones no further than 0.8 strokes from the line.
Region stroke(const Loop& line, double width) {
  Loop right;
  Loop left;
  for (size_t i = 0; i < line.size(); ++i) {
    const size_t last = line.size() - 1;
    const Point2 before = i == 0 ? leftOf(line[0], line[1]) : leftOf(line[i - 1], line[i]);
    const Point2 after = i == last ? before : leftOf(line[i], line[i + 1]);
    Point2 middle = {before.x + after.x, before.y + after.y};
    const double length = std::hypot(middle.x, middle.y);
    const double reach = std::min(0.8 * width, width / length);
    middle = {middle.x / length * reach, middle.y / length * reach};
    right.push_back({line[i].x - middle.x, line[i].y - middle.y});
    left.push_back({line[i].x + middle.x, line[i].y + middle.y});
  }
  return {join({right, reversed(left)})};
}

// In the letters below, t is the width of the stroke and w that of the letter.

Region letterA(double t) {
  const double w = 0.9;
  const double c = w / 2;
  const double lean = c - t / 2;  // the legs' outer edges go from x = 0 to x = lean
  const double b = 1.05 * t;
  const double bar = 0.2;
  const double top = bar + 0.7 * t;
  const auto inner = [&](double y) { return b + lean * y; };
  return {{{0, 0},
           {b, 0},
           {inner(bar), bar},
           {w - inner(bar), bar},
           {w - b, 0},
           {w, 0},
           {c + t / 2, 1},
           {c - t / 2, 1}},
          {{inner(top), top}, {c, (c - b) / lean}, {w - inner(top), top}}};
}

Region letterB(double t) {
  const double h = 0.7 * t;  // the bars are thinner, to leave room for two holes
  const Loop outline = join({{{0, 0}},
                             arc({0.35, 0.26}, 0.3, 0.26, -90, 60, 6),
                             arc({0.32, 0.76}, 0.28, 0.24, -60, 90, 6),
                             {{0, 1}}});
  const Loop lower =
      join({{{t, h}}, arc({0.35, 0.26}, 0.3 - t, 0.26 - h, -90, 90, 5), {{t, 0.52 - h}}});
  const Loop upper =
      join({{{t, 0.52 + h}}, arc({0.32, 0.76}, 0.28 - t, 0.24 - h, -90, 90, 5), {{t, 1 - h}}});
  return {outline, reversed(lower), reversed(upper)};
}

Region letterD(double t) {
  return {
      join({{{0, 0}}, arc({0.3, 0.5}, 0.42, 0.5, -90, 90, 12), {{0, 1}}}),
      reversed(join({{{t, t}}, arc({0.3, 0.5}, 0.42 - t, 0.5 - t, -90, 90, 10), {{t, 1 - t}}}))};
}

// From where E and F have their middle arm, around both arms that they share.
Loop upperArms(double t) {
  const double w = 0.62;
  const double arm = 0.85 * w;
  const double low = 0.5 - t / 2;
  const double high = 0.5 + t / 2;
  return {{t, low}, {arm, low}, {arm, high}, {t, high}, {t, 1 - t}, {w, 1 - t}, {w, 1}, {0, 1}};
}

Region letterE(double t) {
  const double w = 0.62;
  return {join({{{0, 0}, {w, 0}, {w, t}, {t, t}}, upperArms(t)})};
}

Region letterF(double t) {
  return {join({{{0, 0}, {t, 0}}, upperArms(t)})};
}

Region letterH(double t) {
  const double w = 0.72;
  const double low = 0.5 - t / 2;
  const double high = 0.5 + t / 2;
  return {{{0, 0},
           {t, 0},
           {t, low},
           {w - t, low},
           {w - t, 0},
           {w, 0},
           {w, 1},
           {w - t, 1},
           {w - t, high},
           {t, high},
           {t, 1},
           {0, 1}}};
}

Region letterK(double t) {
  const double w = 0.72;
  const double b = 1.25 * t;
  const double notch = 1.9 * t;
  const double reach = 0.5 * t;
  return {{{0, 0},
           {t, 0},
           {t, 0.5 - reach},
           {w - b, 0},
           {w, 0},
           {notch, 0.5},
           {w, 1},
           {w - b, 1},
           {t, 0.5 + reach},
           {t, 1},
           {0, 1}}};
}

// The bowl that P and R share; the arc starts where the letter's outline reaches it.
Loop bowl(double start, int pieces) {
  return arc({0.33, 0.71}, 0.32, 0.29, start, 90, pieces);
}

Loop bowlHole(double t) {
  const double h = 0.8 * t;
  return reversed(
      join({{{t, 0.42 + h}}, arc({0.33, 0.71}, 0.32 - t, 0.29 - h, -90, 90, 8), {{t, 1 - h}}}));
}

Region letterP(double t) {
  return {join({{{0, 0}, {t, 0}, {t, 0.42}}, bowl(-90, 10), {{0, 1}}}), bowlHole(t)};
}

Region letterR(double t) {
  const double w = 0.68;
  return {join({{{0, 0}, {t, 0}, {t, 0.42}, {0.3, 0.42}, {w - 1.2 * t, 0}, {w, 0}},
                bowl(-50, 8),
                {{0, 1}}}),
          bowlHole(t)};
}

Region letterO(double t) {
  const Point2 centre = {0.42, 0.5};
  return {ellipse(centre, 0.42, 0.5, 18), reversed(ellipse(centre, 0.42 - t, 0.5 - t, 14))};
}

Region letterQ(double t) {
  const Point2 centre = {0.42, 0.5};
  return {join({arc(centre, 0.42, 0.5, -30, 300, 16), {{0.72, -0.12}, {0.88, 0.02}}}),
          reversed(ellipse(centre, 0.42 - t, 0.5 - t, 13))};
}

Region letterT(double t) {
  const double w = 0.7;
  const double c = w / 2;
  return {{{c - t / 2, 0},
           {c + t / 2, 0},
           {c + t / 2, 1 - t},
           {w, 1 - t},
           {w, 1},
           {0, 1},
           {0, 1 - t},
           {c - t / 2, 1 - t}}};
}

Region letterX(double t) {
  const double w = 0.76;
  const double c = w / 2;
  const double b = 1.25 * t;
  const double fork = (c - b) / (w - b);  // where the two strokes' edges meet
  return {{{0, 0},
           {b, 0},
           {c, fork},
           {w - b, 0},
           {w, 0},
           {w - (w - b) / 2, 0.5},
           {w, 1},
           {w - b, 1},
           {c, 1 - fork},
           {b, 1},
           {0, 1},
           {(w - b) / 2, 0.5}}};
}

Region letterY(double t) {
  const double w = 0.76;
  const double c = w / 2;
  const double b = 1.2 * t;
  const double fork = 0.42;
  const double slope = (1 - fork) / (w - c - t / 2);
  return {{{c - t / 2, 0},
           {c + t / 2, 0},
           {c + t / 2, fork},
           {w, 1},
           {w - b, 1},
           {c, 1 - slope * (w - b - c)},
           {b, 1},
           {0, 1},
           {c - t / 2, fork}}};
}

Region letterG(double t) {
  const double s = t / 2;
  return stroke(
      join({arc({0.4, 0.5}, 0.4 - s, 0.5 - s, 50, 340, 14), {{0.8 - s, 0.46}, {0.45, 0.46}}}), t);
}

Region letterS(double t) {
  const double s = t / 2;
  return stroke(join({arc({0.3, 0.75 - s / 2}, 0.28, 0.25 - s / 2, 20, 255, 8),
                      arc({0.3, 0.25 + s / 2}, 0.28, 0.25 - s / 2, 75, -160, 8)}),
                t);
}

Region letterU(double t) {
  const double s = t / 2;
  return stroke(
      join({{{s, 1}}, arc({0.36, 0.36}, 0.36 - s, 0.36 - s, 180, 360, 12), {{0.72 - s, 1}}}), t);
}

}  // namespace

Region letterOutline(int letter, double t) {
  const double s = t / 2;  // half a stroke: pen strokes run along their middle
  switch ('A' + letter) {
    case 'A':
      return letterA(t);
    case 'B':
      return letterB(t);
    case 'C':
      return stroke(arc({0.4, 0.5}, 0.4 - s, 0.5 - s, 50, 310, 14), t);
    case 'D':
      return letterD(t);
    case 'E':
      return letterE(t);
    case 'F':
      return letterF(t);
    case 'G':
      return letterG(t);
    case 'H':
      return letterH(t);
    case 'I':
      return stroke({{s, 1}, {s, 0}}, t);
    case 'J':
      return stroke(join({{{0.5, 1}}, arc({0.25, 0.3}, 0.25, 0.3 - s, 0, -170, 10)}), t);
    case 'K':
      return letterK(t);
    case 'L':
      return stroke({{s, 1}, {s, s}, {0.62, s}}, t);
    case 'M':
      return stroke({{s, 0}, {s, 1 - s}, {0.45, 0.35}, {0.9 - s, 1 - s}, {0.9 - s, 0}}, t);
    case 'N':
      return stroke({{s, 0}, {s, 1 - s}, {0.72 - s, s}, {0.72 - s, 1}}, t);
    case 'O':
      return letterO(t);
    case 'P':
      return letterP(t);
    case 'Q':
      return letterQ(t);
    case 'R':
      return letterR(t);
    case 'S':
      return letterS(t);
    case 'T':
      return letterT(t);
    case 'U':
      return letterU(t);
    case 'V':
      return stroke({{s, 1}, {0.38, s}, {0.76 - s, 1}}, t);
    case 'W':
      return stroke({{s, 1}, {0.27, s}, {0.5, 0.75}, {0.73, s}, {1 - s, 1}}, t);
    case 'X':
      return letterX(t);
    case 'Y':
      return letterY(t);
    case 'Z':
      return stroke({{0, 1 - s}, {0.66 - s, 1 - s}, {s, s}, {0.68, s}}, t);
    default:
      throw std::out_of_range("there are 26 letters");
  }
}

}  // namespace pile
