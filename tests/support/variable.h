// Environment variables, set for a while.
#pragma once

#include <cstdlib>
#include <string>

namespace sap_test {

// Value 0: not set.
inline void setVariable(const char* name, const char* value) {
#if defined(_WIN32)
  _putenv_s(name, value ? value : "");
#else
  if (value) {
    setenv(name, value, 1);
  } else {
    unsetenv(name);
  }
#endif
}

// A variable of the environment as long as the scope lasts; value 0: not set.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) {
      before_ = before;
      was_set_ = true;
    }
    setVariable(name, value);
  }
  ~Variable() { setVariable(name_.c_str(), was_set_ ? before_.c_str() : nullptr); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  std::string name_, before_;
  bool was_set_ = false;
};

// What the person who runs the tests has set must not get into them.
struct BareEnvironment {
  Variable backend{"ODE_PARALLEL_SAP_BACKEND", nullptr}, method{"ODE_PARALLEL_SAP_METHOD", nullptr},
      threads{"ODE_PARALLEL_SAP_THREADS", nullptr}, devices{"ODE_PARALLEL_SAP_DEVICES", nullptr},
      stats{"ODE_PARALLEL_SAP_STATS", nullptr}, simd{"ODE_PARALLEL_SAP_SIMD", nullptr},
      skip_static{"ODE_PARALLEL_SAP_SKIP_STATIC", nullptr},
      skip_asleep{"ODE_PARALLEL_SAP_SKIP_ASLEEP", nullptr},
      cull_planes{"ODE_PARALLEL_SAP_CULL_PLANES", nullptr},
      tolerance{"ODE_PARALLEL_SAP_TOLERANCE", nullptr},
      notified{"ODE_PARALLEL_SAP_NOTIFIED", nullptr};
};

}  // namespace sap_test
