// In place of Scalable-CCD's own logger, which its sweep tells when memory runs out, and which
// needs spdlog.
#pragma once

#include <stdexcept>
#include <vector>

namespace scalable_ccd {

struct SilentLogger {
  template <class... Arguments>
  void warn(const Arguments&...) {}
};

inline SilentLogger& logger() {
  static SilentLogger silent;
  return silent;
}

}  // namespace scalable_ccd
