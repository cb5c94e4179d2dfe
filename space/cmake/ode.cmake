# Finds ODE and, for the one source file that derives from dxSpace, the private headers of exactly
# the same version.
include_guard(GLOBAL)

find_package(PkgConfig REQUIRED)
pkg_check_modules(ODE_PARALLEL_SAP_LIBODE REQUIRED IMPORTED_TARGET ode)
set(ode_version "${ODE_PARALLEL_SAP_LIBODE_VERSION}")

set(ODE_SOURCE_DIR "" CACHE PATH "ODE's source tree, of the version that is linked")
set(ode_source_dir "${ODE_SOURCE_DIR}")
if(NOT ode_source_dir)
  set(ode_source_dir "${PROJECT_SOURCE_DIR}/.ode/ode-${ode_version}")
endif()
if(NOT EXISTS "${ode_source_dir}/ode/src/collision_kernel.h")
  message(FATAL_ERROR "ODE's private headers were not found in ${ode_source_dir}")
endif()

set(ode_private_dir "${PROJECT_BINARY_DIR}/ode-private")
configure_file("${CMAKE_CURRENT_LIST_DIR}/config.h.in" "${ode_private_dir}/config.h")
set(ODE_PRIVATE_INCLUDE_DIRS "${ode_private_dir}" "${ode_source_dir}/ode/src"
                             "${ode_source_dir}/ou/include")
