#include "not_finite.h"

#include <limits>

namespace sap_test {

const dReal kInfinity = std::numeric_limits<dReal>::infinity();
const dReal kNaN = std::numeric_limits<dReal>::quiet_NaN();

}  // namespace sap_test
