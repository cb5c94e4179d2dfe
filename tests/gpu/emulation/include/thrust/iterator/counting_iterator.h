// In the place of Thrust's.
#pragma once

namespace thrust {

template <class Value>
struct counting_iterator {
  Value first;
  explicit counting_iterator(Value first) : first(first) {}
  Value operator[](long long i) const { return first + static_cast<Value>(i); }
};

}  // namespace thrust
