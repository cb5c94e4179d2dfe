// One row a cell. Columns are named where they are filled, once, in order.
#pragma once

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace bench {

class Row {
 public:
  Row& add(const char* column, const std::string& value);
  Row& add(const char* column, std::size_t value);
  Row& add(const char* column, int value);
  // Four digits; nothing for NaN.
  Row& add(const char* column, double value);
  // How many samples there are (one at least), their median and the least.
  Row& addTimes(const std::vector<double>& ms);
  // CPU, GPU, compiler, commit, date: the last columns of every file.
  Row& addMachine();

  std::string names() const;
  std::string values() const;

 private:
  std::vector<std::pair<std::string, std::string>> cells_;
};

// Where rows are to go; nowhere if the path is empty.
struct CsvFile {
  std::string path;
  bool append = false;
};

// Rows with the same columns, each on disk as soon as it is written.
class Csv {
 public:
  // Throws std::runtime_error.
  explicit Csv(const CsvFile& file);
  ~Csv();
  Csv(const Csv&) = delete;
  Csv& operator=(const Csv&) = delete;
  void write(const Row& row);

 private:
  std::FILE* file_ = nullptr;
  bool needs_names_ = true;
};

// NaN if there is none.
double median(std::vector<double> values);
double mean(const std::vector<double>& values);

}  // namespace bench
