#include "rows.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace sap_test {
namespace physics {

const char* const kPrecision = sizeof(dReal) == 8 ? "double" : "single";
const char* const kNotLookedFor = "not looked for";
const char* const kNone = "none of these";

namespace {

const char* const kNames =
    "precision,theme,extreme,simple,hash,ours,same_bits,sink,shift,creep,depth,speed,gain,lost,gap,"
    "energy,momentum,turn,rescue,rescue_cost";

constexpr double Measures::*kMeasures[] = {&Measures::sink,     &Measures::shift, &Measures::creep,
                                           &Measures::depth,    &Measures::speed, &Measures::gain,
                                           &Measures::lost,     &Measures::gap,   &Measures::energy,
                                           &Measures::momentum, &Measures::turn};

std::string lineOf(const Row& row) {
  std::ostringstream text;
  text << kPrecision << "," << row.theme << ",\"" << row.extreme << "\"," << row.simple << ","
       << row.hash << "," << row.ours << "," << row.same;
  for (double Measures::*const measure : kMeasures) text << "," << row.measures.*measure;
  text << ",\"" << row.rescue << "\"," << row.cost << "\n";
  return text.str();
}

// Its values; what is between quotation marks may have commas.
std::vector<std::string> valuesOf(const std::string& line) {
  std::vector<std::string> values(1);
  bool quoted = false;
  for (const char letter : line) {
    if (letter == '"') {
      quoted = !quoted;
    } else if (letter == ',' && !quoted) {
      values.emplace_back();
    } else {
      values.back() += letter;
    }
  }
  return values;
}

Row rowOf(const std::vector<std::string>& values) {
  Row row;
  row.theme = values[1];
  row.extreme = values[2];
  row.simple = values[3];
  row.hash = values[4];
  row.ours = values[5];
  row.same = values[6] == "1";
  std::size_t next = 7;
  for (double Measures::*const measure : kMeasures)
    row.measures.*measure = std::stod(values[next++]);
  row.rescue = values[next++];
  row.cost = std::stod(values[next]);
  return row;
}

// Their place among extremes(), or beyond.
std::size_t placeOf(const Row& row) {
  const auto found =
      std::find_if(extremes().begin(), extremes().end(),
                   [&row](const Extreme& extreme) { return extreme.name == row.extreme; });
  return static_cast<std::size_t>(found - extremes().begin());
}

}  // namespace

std::string shown(const Result& result) {
  if (result.outcome != "not finite" && result.outcome != "aborts") return result.outcome;
  return result.outcome + " at step " + std::to_string(result.steps);
}

std::vector<Row> readRows(const std::string& file) {
  std::ifstream stream(file);
  std::vector<Row> rows;
  std::string line;
  if (!std::getline(stream, line)) return rows;
  if (line != kNames) throw std::runtime_error(file + " has other columns");
  // A line that no line's end follows was cut short.
  while (std::getline(stream, line) && !stream.eof()) {
    const std::vector<std::string> values = valuesOf(line);
    if (values.size() != 20 || values[0] != kPrecision)
      throw std::runtime_error(file + " has a row that is none of " + kPrecision +
                               " precision: " + line);
    rows.push_back(rowOf(values));
  }
  return rows;
}

void addRow(const std::string& file, const Row& row) {
  const bool empty = std::ifstream(file).peek() == std::ifstream::traits_type::eof();
  std::ofstream stream(file, std::ios::app);
  if (empty) stream << kNames << "\n";
  stream << lineOf(row) << std::flush;
  if (!stream) throw std::runtime_error("cannot write " + file);
}

void writeRows(const std::string& file, std::vector<Row> rows) {
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return placeOf(a) < placeOf(b); });
  std::ofstream stream(file);
  stream << kNames << "\n";
  for (const Row& row : rows) stream << lineOf(row);
  if (!stream.flush()) throw std::runtime_error("cannot write " + file);
}

}  // namespace physics
}  // namespace sap_test
