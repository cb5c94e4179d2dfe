# Finds ODE, and the private headers of exactly its version for the source files that derive from dxSpace;
# or takes those that the user names, of whatever version or fork; then checks that library and headers
# agree. Sets
#
#   PkgConfig::ODE_PARALLEL_SAP_LIBODE   the library and its public headers
#   ODE_PRIVATE_INCLUDE_DIRS             for #include "config.h", then "collision_kernel.h"
#   ODE_PARALLEL_SAP_ODE_PREFIX          where ODE was installed to if this build made it, else empty
include_guard(GLOBAL)
include("${CMAKE_CURRENT_LIST_DIR}/ode_source.cmake")
find_package(PkgConfig REQUIRED)

# What is built where the system has no ODE and no source tree is named.
set(ode_default_version 0.16.2)

set(ODE_SOURCE_DIR "" CACHE PATH "ODE's source tree; empty: fetched in the version that is needed")
set(ODE_PARALLEL_SAP_PRECISION DOUBLE CACHE STRING "Precision of ODE's dReal: DOUBLE or SINGLE")
set_property(CACHE ODE_PARALLEL_SAP_PRECISION PROPERTY STRINGS DOUBLE SINGLE)
check_choice(ODE_PARALLEL_SAP_PRECISION DOUBLE SINGLE)

if(NOT DEFINED ODE_PARALLEL_SAP_ODE)
  pkg_check_modules(ode_of_system QUIET ode)
  set(choice SOURCE)
  if(ode_of_system_FOUND)
    set(choice SYSTEM)
  endif()
  set(ODE_PARALLEL_SAP_ODE ${choice} CACHE STRING "SYSTEM: the installed ODE; SOURCE: built from its source; HEADERS: a fork")
endif()
set_property(CACHE ODE_PARALLEL_SAP_ODE PROPERTY STRINGS SYSTEM SOURCE HEADERS)
check_choice(ODE_PARALLEL_SAP_ODE SYSTEM SOURCE HEADERS)

# The source tree: the one the user named, or one of the given version.
function(choose_ode_source version result)
  if(ODE_SOURCE_DIR)
    get_filename_component(directory "${ODE_SOURCE_DIR}" ABSOLUTE BASE_DIR "${CMAKE_SOURCE_DIR}")
    read_ode_source_version("${directory}" found)
    if(NOT found)
      message(FATAL_ERROR "ODE_SOURCE_DIR=${ODE_SOURCE_DIR} is not an ODE source tree: it has no "
                          "configure.ac and ode/src/collision_kernel.h.")
    endif()
  else()
    get_ode_source(${version} directory)
    if(NOT directory)
      message(
        FATAL_ERROR
          "The source of ODE ${version}, whose private headers are needed, could be fetched neither from the "
          "Debian archive nor from upstream's repositories (see above). Remedies: unpack that version yourself "
          "and configure with -DODE_SOURCE_DIR=<directory>, which examples/run and tests/run take, too; "
          "or, for another version than the installed one, "
          "with -DODE_PARALLEL_SAP_ODE=SOURCE -DODE_SOURCE_DIR=<directory>.")
    endif()
  endif()
  set(${result} "${directory}" PARENT_SCOPE)
endfunction()

# pkg-config is asked anew by every configure: the answer of another mode or version may be cached.
macro(find_libode)
  unset(__pkg_config_checked_ODE_PARALLEL_SAP_LIBODE CACHE)
  unset(pkgcfg_lib_ODE_PARALLEL_SAP_LIBODE_ode CACHE)
  pkg_check_modules(ODE_PARALLEL_SAP_LIBODE QUIET IMPORTED_TARGET GLOBAL ode)
endmacro()

set(ODE_PARALLEL_SAP_ODE_PREFIX "")
set(ode_private_dir "${PROJECT_BINARY_DIR}/ode-private")
if(ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  include("${CMAKE_CURRENT_LIST_DIR}/ode_headers.cmake")
  include("${CMAKE_CURRENT_LIST_DIR}/check_ode.cmake")
  return()
endif()
if(ODE_PARALLEL_SAP_ODE STREQUAL "SOURCE")
  choose_ode_source(${ode_default_version} ode_source_dir)
  build_ode("${ode_source_dir}" ${ODE_PARALLEL_SAP_PRECISION} ODE_PARALLEL_SAP_ODE_PREFIX)
  set(pkg_config_path "$ENV{PKG_CONFIG_PATH}")
  set(ENV{PKG_CONFIG_PATH} "${ODE_PARALLEL_SAP_ODE_PREFIX}/lib/pkgconfig:${pkg_config_path}")
  find_libode()
  set(ENV{PKG_CONFIG_PATH} "${pkg_config_path}")
else()
  find_libode()
endif()

if(NOT ODE_PARALLEL_SAP_LIBODE_FOUND)
  message(FATAL_ERROR "pkg-config finds no ODE. Remedies: install it (Debian: libode-dev), add the directory of its "
                      "ode.pc to PKG_CONFIG_PATH, or configure with -DODE_PARALLEL_SAP_ODE=SOURCE.")
endif()
set(ODE_PARALLEL_SAP_ODE_VERSION "${ODE_PARALLEL_SAP_LIBODE_VERSION}")
if(NOT ODE_PARALLEL_SAP_ODE_VERSION MATCHES "^0\\.16(\\.|$)")
  message(FATAL_ERROR "The ODE found is version ${ODE_PARALLEL_SAP_ODE_VERSION}; ode-parallel-sap works with 0.16. Remedies: "
                      "add the directory of another version's ode.pc to PKG_CONFIG_PATH, or configure with "
                      "-DODE_PARALLEL_SAP_ODE=SOURCE.")
endif()

if(ODE_PARALLEL_SAP_ODE STREQUAL "SYSTEM")
  choose_ode_source(${ODE_PARALLEL_SAP_ODE_VERSION} ode_source_dir)
endif()
read_ode_source_version("${ode_source_dir}" ode_source_version)
if(NOT ode_source_version VERSION_EQUAL ODE_PARALLEL_SAP_ODE_VERSION)
  message(FATAL_ERROR "The ODE found is version ${ODE_PARALLEL_SAP_ODE_VERSION}, but ODE_SOURCE_DIR=${ODE_SOURCE_DIR} is "
                      "version ${ode_source_version}. Remedies: name the source of ${ODE_PARALLEL_SAP_ODE_VERSION}, leave "
                      "ODE_SOURCE_DIR empty to have it fetched, or build ODE from that source with "
                      "-DODE_PARALLEL_SAP_ODE=SOURCE.")
endif()

set(ODE_PRIVATE_INCLUDE_DIRS "${ode_private_dir}" "${ode_source_dir}/ode/src" "${ode_source_dir}/ou/include")
include("${CMAKE_CURRENT_LIST_DIR}/check_ode.cmake")
