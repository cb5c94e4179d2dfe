# cmake -DSOURCE=... -DVERSION=... -P conda_ode.cmake: says where ODE's source tree of that version is, fetched if need be.
set(PROJECT_SOURCE_DIR "${SOURCE}")
set(PROJECT_BINARY_DIR "${CMAKE_CURRENT_BINARY_DIR}")
include("${SOURCE}/space/cmake/ode_source.cmake")
get_ode_source(${VERSION} directory)
if(directory)
  message("ode source tree: ${directory}")
endif()
