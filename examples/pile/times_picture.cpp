#include "times_picture.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "spaces.h"

namespace pile {
namespace {

constexpr double frame_ms = 1000.0 / 60;  // of a display: what a step may take to keep up with it

constexpr int left = 130;  // all in pixels
constexpr int top = 76;
constexpr int bar_height = 26;
constexpr int row_height = 40;
constexpr int right = 190;

const char* const colours[] = {"#d55e00", "#e69f00", "#999999", "#0072b2"};  // also told by name

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string text(double x, double y, const std::string& words, const char* more = "") {
  return format("  <text x=\"%g\" y=\"%g\"%s>", x, y, more) + words + "</text>\n";
}

// "contact joints" as the name of an element.
std::string identifier(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string bar(const Part& part, double step, int row) {
  const double share = step > 0 ? part.ms / step : 0;
  const double y = top + row_height * row;
  const double length = times_picture_length * share;
  const double middle = y + 0.7 * bar_height;
  return text(left - 10, middle, part.name, " text-anchor=\"end\"") +
         format("  <rect id=\"%s\" x=\"%d\" y=\"%g\" width=\"%.3f\" height=\"%d\" fill=\"%s\"/>\n",
                identifier(part.name).c_str(), left, y, length, bar_height, colours[row]) +
         text(left + length + 8, middle,
              format("%.3f ms, %.1f %%, %s", part.ms, 100 * share,
                     counted(part.threads, "thread").c_str()));
}

// Where a display's next frame is due, if that is within the step.
std::string frameLine(double step, int rows) {
  if (step < frame_ms) return "";
  const double x = left + times_picture_length * frame_ms / step;
  const double end = top + row_height * rows;
  return format(
             "  <line x1=\"%g\" y1=\"%d\" x2=\"%g\" y2=\"%g\" stroke=\"black\" "
             "stroke-dasharray=\"4 3\"/>\n",
             x, top - 6, x, end) +
         text(x, end + 14, "16.7 ms: 60 steps a second", " text-anchor=\"middle\"");
}

}  // namespace

bool writeTimesPicture(const Totals& totals, const World& world, const Options& options,
                       const std::string& file) {
  const std::vector<Part> parts = totals.parts();
  const double step = totals.totalMs() / totals.frames;
  const int rows = static_cast<int>(parts.size());
  const double width = left + times_picture_length + right;
  const double height = top + row_height * rows + 30;
  std::ofstream svg(file);
  svg << format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
             "font-family=\"sans-serif\" font-size=\"13\">\n",
             width, height)
      << format("  <rect width=\"%g\" height=\"%g\" fill=\"white\"/>\n", width, height)
      << text(left, 26,
              format("%s: %zu %s, a mean step of %.2f ms", options.scene.c_str(),
                     world.bodies().size(), world.body_name.c_str(), step),
              " font-size=\"17\"")
      << text(left, 50, describeSpace(world.space()) + ", " + counted(totals.frames, "step"));
  for (int row = 0; row < rows; ++row) svg << bar(parts[static_cast<size_t>(row)], step, row);
  svg << frameLine(step, rows) << "</svg>\n";
  svg.close();
  return !svg.fail();
}

}  // namespace pile
