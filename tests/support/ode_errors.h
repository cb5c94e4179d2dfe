// ODE's failed assertions as exceptions, its messages as strings.
#pragma once

#include <ode/ode.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace sap_test {

// What a failed dUASSERT, dAASSERT or dIASSERT becomes in these tests.
struct OdeAssertion : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Makes dDebug and dError throw OdeAssertion instead of ending the program.
void throwOdeErrors();

// Whether this ODE was built with its assertions. Release builds of its own CMake project have
// none, and then a wrong call that does not reach the library goes unnoticed.
bool odeHasAssertions();

// Collects what passes through dMessage during its life; one at a time.
class Messages {
 public:
  Messages();
  ~Messages();
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;

  const std::vector<std::string>& all() const { return texts_; }

 private:
  static void receive(int number, const char* format, va_list arguments);

  static Messages* listening_;
  dMessageFunction* before_;
  std::vector<std::string> texts_;
};

}  // namespace sap_test
