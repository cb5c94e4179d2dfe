#include "ode_errors.h"

#include <cstdarg>
#include <cstdio>

namespace sap_test {
namespace {

std::string formatted(const char* format, va_list arguments) {
  char text[1000];
  std::vsnprintf(text, sizeof text, format, arguments);
  return text;
}

void throwAssertion(int, const char* format, va_list arguments) {
  throw OdeAssertion(formatted(format, arguments));
}

}  // namespace

void throwOdeErrors() {
  dSetDebugHandler(throwAssertion);
  dSetErrorHandler(throwAssertion);
}

bool odeHasAssertions() {
  const dGeomID geom = dCreateSphere(nullptr, 1);
  bool has = false;
  try {
    dGeomSphereSetRadius(geom, -1);
  } catch (const OdeAssertion&) {
    has = true;
  }
  dGeomDestroy(geom);
  return has;
}

Messages* Messages::listening_ = nullptr;

Messages::Messages() : before_(dGetMessageHandler()) {
  if (listening_) throw std::logic_error("two Messages at once");
  listening_ = this;
  dSetMessageHandler(receive);
}

Messages::~Messages() {
  dSetMessageHandler(before_);
  listening_ = nullptr;
}

void Messages::receive(int, const char* format, va_list arguments) {
  listening_->texts_.push_back(formatted(format, arguments));
}

}  // namespace sap_test
