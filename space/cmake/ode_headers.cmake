# ODE_PARALLEL_SAP_ODE=HEADERS: a library with its headers, as the user names them: a fork of ODE, or one
# that pkg-config does not know. No version is asked for: the check of the layout decides.
include_guard(GLOBAL)

set(ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS "" CACHE STRING "HEADERS: the directories of ODE's public headers, for <ode/ode.h>")
set(ODE_PARALLEL_SAP_ODE_PRIVATE_DIRS "" CACHE STRING
    "HEADERS: the directories of its private headers (ode/src, ou/include) and, if it has one, of its config.h")
set(ODE_PARALLEL_SAP_ODE_LIBRARY "" CACHE FILEPATH "HEADERS: the library")
set(ODE_PARALLEL_SAP_ODE_DEFINITIONS "" CACHE STRING "HEADERS: what its users are compiled with, for instance dIDEDOUBLE")

# Fails unless `file` is in one of the directories that `variable` names.
function(expect_header variable file)
  foreach(directory IN LISTS ${variable})
    if(EXISTS "${directory}/${file}")
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "ODE_PARALLEL_SAP_ODE=HEADERS: ${variable}=${${variable}} has no ${file}.")
endfunction()
expect_header(ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS ode/ode.h)
expect_header(ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS ode/version.h)
expect_header(ODE_PARALLEL_SAP_ODE_PRIVATE_DIRS collision_kernel.h)
if(NOT EXISTS "${ODE_PARALLEL_SAP_ODE_LIBRARY}")
  message(FATAL_ERROR "ODE_PARALLEL_SAP_ODE=HEADERS: there is no ODE_PARALLEL_SAP_ODE_LIBRARY=${ODE_PARALLEL_SAP_ODE_LIBRARY}.")
endif()

add_library(PkgConfig::ODE_PARALLEL_SAP_LIBODE INTERFACE IMPORTED GLOBAL)
set_target_properties(
  PkgConfig::ODE_PARALLEL_SAP_LIBODE
  PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS}"
             INTERFACE_LINK_LIBRARIES "${ODE_PARALLEL_SAP_ODE_LIBRARY}"
             INTERFACE_COMPILE_DEFINITIONS "${ODE_PARALLEL_SAP_ODE_DEFINITIONS}")
set(ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES "${ODE_PARALLEL_SAP_ODE_LIBRARY}")
set(ODE_PARALLEL_SAP_LIBODE_CFLAGS ${ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS} ${ODE_PARALLEL_SAP_ODE_DEFINITIONS})

foreach(directory IN LISTS ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS)
  if(EXISTS "${directory}/ode/version.h")
    file(STRINGS "${directory}/ode/version.h" line REGEX "dODE_VERSION" LIMIT_COUNT 1)
    string(REGEX MATCH "[0-9][0-9.]*" ODE_PARALLEL_SAP_ODE_VERSION "${line}")
  endif()
endforeach()

# A config.h of its own comes before the one made here.
set(ODE_PRIVATE_INCLUDE_DIRS ${ODE_PARALLEL_SAP_ODE_PRIVATE_DIRS} "${ode_private_dir}")
set(ode_source_dir "")
