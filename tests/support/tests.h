// What most tests use.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "bounds.h"
#include "catch.hpp"
#include "configurations.h"
#include "knobs.h"
#include "not_finite.h"
#include "ode_errors.h"
#include "oracle.h"
#include "random.h"
#include "recorder.h"
#include "scenes.h"
