#include "csv.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "machine.h"

namespace bench {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

}  // namespace

Row& Row::add(const char* column, const std::string& value) {
  cells_.emplace_back(column, value);
  return *this;
}

Row& Row::add(const char* column, std::size_t value) {
  return add(column, std::to_string(value));
}

Row& Row::add(const char* column, int value) {
  return add(column, std::to_string(value));
}

Row& Row::add(const char* column, double value) {
  if (std::isnan(value)) return add(column, std::string());
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return add(column, std::string(text));
}

Row& Row::addTimes(const std::vector<double>& ms) {
  const auto [least, greatest] = std::minmax_element(ms.begin(), ms.end());
  return add("samples", ms.size())
      .add("median_ms", median(ms))
      .add("min_ms", ms.empty() ? none : *least)
      .add("mean_ms", mean(ms))
      .add("max_ms", ms.empty() ? none : *greatest);
}

Csv::Csv(const CsvFile& file) {
  if (file.path.empty()) return;
  file_ = std::fopen(file.path.c_str(), file.append ? "a" : "w");
  if (!file_) throw std::runtime_error("cannot write " + file.path);
  std::fseek(file_, 0, SEEK_END);
  needs_names_ = std::ftell(file_) == 0;
}

Csv::~Csv() {
  if (file_) std::fclose(file_);
}

void Csv::write(Row row) {
  std::string text;
  for (const auto& [name, value] : row.cells_)
    if (!value.empty()) text += name + "=" + value + "  ";
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
  if (!file_) return;
  const Machine& m = machine();
  row.add("cpu", m.cpu)
      .add("cores", m.cores)
      .add("gpu", m.gpu)
      .add("driver", m.driver)
      .add("compiler", m.compiler)
      .add("flags", m.flags)
      .add("commit", m.commit)
      .add("date", m.date);
  std::string names, values;
  for (const auto& [name, value] : row.cells_) {
    const char* const comma = names.empty() ? "" : ",";
    names += comma + name;
    values += comma + quoted(value);
  }
  if (needs_names_) std::fprintf(file_, "%s\n", names.c_str());
  needs_names_ = false;
  std::fprintf(file_, "%s\n", values.c_str());
  std::fflush(file_);
  if (std::ferror(file_)) throw std::runtime_error("the CSV file cannot be written");
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return none;
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return none;
  const std::size_t middle = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle),
                   values.end());
  if (values.size() % 2 == 1) return values[middle];
  const double below =
      *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle));
  return (below + values[middle]) / 2;
}

}  // namespace bench
