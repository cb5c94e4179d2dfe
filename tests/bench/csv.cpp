#include "csv.h"

#include <sched.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "commit.h"

namespace bench {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
}

// What follows the colon of the first line that begins with `key`.
std::string valueIn(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t at = line.find_first_not_of(" \t", line.find(':') + 1);
    return at == std::string::npos ? "" : line.substr(at);
  }
  return "";
}

// All GPUs of one model: "2 x NVIDIA H200".
std::string gpus() {
  std::error_code without;
  int count = 0;
  std::string model;
  for (const auto& gpu : std::filesystem::directory_iterator("/proc/driver/nvidia/gpus", without)) {
    ++count;
    model = valueIn(gpu.path() / "information", "Model");
  }
  return count > 0 ? std::to_string(count) + " x " + model : "";
}

// The first word of digits and dots: 580.159.03.
std::string driver() {
  std::ifstream file("/proc/driver/nvidia/version");
  for (std::string word; file >> word;)
    if (std::isdigit(static_cast<unsigned char>(word[0])) && word.find('.') != std::string::npos)
      return word;
  return "";
}

// The machine and the build.
void addMachine(Row& row) {
  cpu_set_t usable;
  const std::time_t now = std::time(nullptr);
  char today[32];
  std::strftime(today, sizeof today, "%Y-%m-%d", std::gmtime(&now));
  row.add("cpu", valueIn("/proc/cpuinfo", "model name"))
      .add("cores", sched_getaffinity(0, sizeof usable, &usable) == 0 ? CPU_COUNT(&usable) : 1)
      .add("gpu", gpus())
      .add("driver", driver())
      .add("compiler", std::string(BENCH_COMPILER))
      .add("flags", std::string(BENCH_FLAGS))
      .add("commit", std::string(BENCH_COMMIT))
      .add("date", std::string(today));
}

}  // namespace

Row& Row::add(const char* column, const std::string& value) {
  cells_.emplace_back(column, value);
  return *this;
}

Row& Row::add(const char* column, double value) {
  char text[32] = "";
  if (!std::isnan(value)) std::snprintf(text, sizeof text, "%.5g", value);
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
  file_.open(file.path, file.append ? std::ios::app | std::ios::ate : std::ios::trunc);
  if (!file_) throw std::runtime_error("cannot write " + file.path);
  needs_names_ = file_.tellp() == 0;
}

void Csv::write(Row row) {
  for (const auto& [name, value] : row.cells_)
    if (!value.empty()) std::printf("%s=%s  ", name.c_str(), value.c_str());
  std::puts("");
  std::fflush(stdout);
  if (!file_.is_open()) return;
  addMachine(row);
  std::string names, values;
  for (const auto& [name, value] : row.cells_) {
    names += "," + name;
    values += "," + quoted(value);
  }
  if (needs_names_) file_ << names.substr(1) << '\n';
  needs_names_ = false;
  file_ << values.substr(1) << std::endl;
  if (!file_) throw std::runtime_error("the CSV file cannot be written");
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return none;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return none;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

}  // namespace bench
