// One row a cell. Columns are named where they are filled, once, in order.
#pragma once

#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace bench {

class Row {
 public:
  Row& add(const char* column, const std::string& value);
  Row& add(const char* column, std::size_t value) { return add(column, std::to_string(value)); }
  Row& add(const char* column, int value) { return add(column, std::to_string(value)); }
  // Five digits; nothing for NaN.
  Row& add(const char* column, double value);
  // How many samples there are, their median, least, mean and greatest.
  Row& addTimes(const std::vector<double>& ms);

 private:
  friend class Csv;
  std::vector<std::pair<std::string, std::string>> cells_;
};

// Where rows are to go; nowhere if the path is empty.
struct CsvFile {
  std::string path;
  bool append = false;
};

// Rows with the same columns, each on disk as soon as it is written. CPU, GPU, compiler, commit and
// date are the last columns of every file.
class Csv {
 public:
  // Throws std::runtime_error.
  explicit Csv(const CsvFile& file);
  // Prints the row, too.
  void write(Row row);

 private:
  std::ofstream file_;
  bool needs_names_ = true;
};

// NaN if there is none.
double median(std::vector<double> values);
double mean(const std::vector<double>& values);

}  // namespace bench
