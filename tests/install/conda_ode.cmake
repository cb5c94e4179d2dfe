# cmake -DSOURCE=... -DVERSION=... -DODE_PARALLEL_SAP_ODE_CACHE=... -P conda_ode.cmake: says where ODE's source tree of that
# version is, fetched if need be.
include("${SOURCE}/space/cmake/ode_source.cmake")
get_ode_source(${VERSION} directory)
if(directory)
  message("ode source tree: ${directory}")
endif()
