#ifndef TRADEOFF_ROW_H
#define TRADEOFF_ROW_H

#include <sstream>
#include <string>

namespace tradeoff {

// What one point measured, as two lines of CSV: names and values.
class Row {
 public:
  template <typename Value>
  void add(const std::string& name, const Value& value) {
    names_ << separator() << name;
    values_.precision(9);
    values_ << separator() << value;
    empty_ = false;
  }

  std::string text() const { return names_.str() + "\n" + values_.str() + "\n"; }

 private:
  const char* separator() const { return empty_ ? "" : ","; }

  bool empty_ = true;
  std::ostringstream names_;
  std::ostringstream values_;
};

}  // namespace tradeoff

#endif
