#include "times_picture.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "spaces.h"

namespace pile {
namespace {

constexpr double frame_ms = 1000.0 / 60;  // of a display: what a step may take to keep up with it

constexpr int left = 170;  // all in pixels
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

std::string bar(const std::string& name, double share, const std::string& words, double y,
                const char* colour) {
  const double length = times_picture_length * share;
  const double middle = y + 0.7 * bar_height;
  return text(left - 10, middle, name, " text-anchor=\"end\"") +
         format("  <rect id=\"%s\" x=\"%d\" y=\"%g\" width=\"%.3f\" height=\"%d\" fill=\"%s\"/>\n",
                identifier(name).c_str(), left, y, length, bar_height, colour) +
         text(left + length + 8, middle, words);
}

std::string partBar(const Part& part, double step, int row) {
  const double share = step > 0 ? part.ms / step : 0;
  return bar(
      part.name, share,
      format("%.3f ms, %.1f %%, %s", part.ms, 100 * share, counted(part.threads, "thread").c_str()),
      top + row_height * row, colours[row]);
}

std::string wayBars(const std::vector<Way>& ways, double y) {
  if (ways.empty()) return "";
  double slowest = 0;
  for (const Way& way : ways) slowest = std::max(slowest, way.step);
  std::string bars = text(left, y + 26, "The same pile: a whole step", " font-size=\"17\"");
  y += 40;
  for (const Way& way : ways) {
    bars += bar(way.name, way.step / slowest,
                format("%.1f ms, %.2f times faster", way.step, ways.front().step / way.step), y,
                "#009e73");
    y += row_height;
  }
  return bars;
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

bool writeTimesPicture(const Totals& totals, const std::vector<Way>& ways, const World& world,
                       const Options& options, const std::string& file) {
  const std::vector<Part> parts = totals.parts();
  const double step = totals.totalMs() / totals.frames;
  const int rows = static_cast<int>(parts.size());
  const double width = left + times_picture_length + right;
  const double end = top + row_height * rows + 30;
  const double height = end + (ways.empty() ? 0 : 40 + row_height * static_cast<int>(ways.size()));
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
  for (int row = 0; row < rows; ++row) svg << partBar(parts[static_cast<size_t>(row)], step, row);
  svg << frameLine(step, rows) << wayBars(ways, end) << "</svg>\n";
  svg.close();
  return !svg.fail();
}

}  // namespace pile
