# Runs two small programs against the ODE that was found: probe_ode.cpp asks what it is, check_ode.cpp
# whether the private headers describe it.
include_guard(GLOBAL)

if(ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  string(CONCAT ode_remedies "Remedy: name headers and library of one build with -DODE_PARALLEL_SAP_ODE_INCLUDE_DIRS, "
                   "-DODE_PARALLEL_SAP_ODE_PRIVATE_DIRS, -DODE_PARALLEL_SAP_ODE_LIBRARY and what it was compiled with in "
                   "-DODE_PARALLEL_SAP_ODE_DEFINITIONS. Where dxSpace is undefined, the library hides its classes "
                   "(-fvisibility=hidden): compile it without that.")
elseif(ODE_PARALLEL_SAP_ODE STREQUAL "SOURCE")
  string(CONCAT ode_remedies "Remedy: remove ${ODE_PARALLEL_SAP_ODE_PREFIX} and configure again, or name an unmodified source "
                   "tree with -DODE_SOURCE_DIR=<directory>.")
else()
  string(CONCAT ode_remedies "Remedies: name the source that the installed ODE was built from with "
                   "-DODE_SOURCE_DIR=<directory>; or have ODE built from its source with "
                   "-DODE_PARALLEL_SAP_ODE=SOURCE.")
endif()

set(ode_private_headers ${ODE_PRIVATE_INCLUDE_DIRS})
list(REMOVE_ITEM ode_private_headers "${ode_private_dir}")

# The private headers as a target, for the check only: the library itself shows them to one file.
add_library(ode-private-headers INTERFACE IMPORTED)
target_include_directories(ode-private-headers INTERFACE ${ODE_PRIVATE_INCLUDE_DIRS} "${PROJECT_SOURCE_DIR}")

# Compiles a program of this directory with the given targets, runs it and sets `result` to what it
# printed. Any failure is an error that begins with `complaint`. Where programs cannot be run because
# they are cross-compiled, the result is empty.
function(run_with_ode program complaint result)
  set(arguments "${PROJECT_BINARY_DIR}/ode-check/${program}" "${ode_cmake_dir}/${program}.cpp")
  set(options
      LINK_LIBRARIES ${ARGN}
      CXX_STANDARD 17
      CXX_STANDARD_REQUIRED ON)
  unset(check_compiled CACHE)
  unset(check_status CACHE)
  if(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
    try_compile(check_compiled ${arguments} ${options} OUTPUT_VARIABLE compile_output)
    set(check_status 0)
    set(run_output "")
  else()
    try_run(check_status check_compiled ${arguments} ${options}
            COMPILE_OUTPUT_VARIABLE compile_output RUN_OUTPUT_VARIABLE run_output)
  endif()
  if(NOT check_compiled)
    message(FATAL_ERROR "${complaint}: ${program}.cpp does not compile and link. ${ode_remedies}\n${compile_output}")
  endif()
  if(NOT check_status STREQUAL "0")
    message(FATAL_ERROR "${complaint}. ${ode_remedies}\n"
                        "${program}.cpp ended with status ${check_status} and said:\n${run_output}")
  endif()
  set(${result} "${run_output}" PARENT_SCOPE)
endfunction()

# Nothing is run again until something that could change the outcome has changed.
set(fingerprint "${ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES} ${ODE_PARALLEL_SAP_LIBODE_CFLAGS} ${CMAKE_CXX_FLAGS}")
string(APPEND fingerprint "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_COMPILER_VERSION} ${ODE_PARALLEL_SAP_PRECISION}")
file(GLOB inputs "${ode_cmake_dir}/*ode*" "${ode_cmake_dir}/config.h.in" "${PROJECT_SOURCE_DIR}/space/geoms/ode_private.h"
     "${PROJECT_SOURCE_DIR}/space/preload/ode_layout.h")
foreach(directory IN LISTS ODE_PRIVATE_INCLUDE_DIRS)
  if(NOT directory STREQUAL ode_private_dir)
    file(GLOB headers "${directory}/*.h")
    list(APPEND inputs ${headers})
  endif()
endforeach()
foreach(input IN LISTS inputs ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES)
  if(EXISTS "${input}" AND NOT IS_DIRECTORY "${input}")
    file(SHA256 "${input}" hash)
    string(APPEND fingerprint " ${input} ${hash}")
  endif()
endforeach()
string(SHA256 fingerprint "${fingerprint}")
if("${fingerprint}" STREQUAL "${ODE_PARALLEL_SAP_CHECKED}" AND EXISTS "${ode_private_dir}/config.h")
  return()
endif()
unset(ODE_PARALLEL_SAP_CHECKED CACHE)

run_with_ode(probe_ode "The ODE ${ODE_PARALLEL_SAP_ODE_VERSION} that was found cannot be used" ode_says
             PkgConfig::ODE_PARALLEL_SAP_LIBODE)
# Wine adds lines of its own when it runs for the first time.
string(REGEX MATCH "[^\n;]+;(SINGLE|DOUBLE);(SINGLE|DOUBLE);[0-9]+" ode_says "${ode_says}")
set(ODE_HAS_TLS OFF)
if(ode_says)
  list(GET ode_says 0 header_version)
  list(GET ode_says 1 header_precision)
  list(GET ode_says 2 library_precision)
  list(GET ode_says 3 ODE_HAS_TLS)
  if(NOT ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS" AND NOT header_version VERSION_EQUAL ODE_PARALLEL_SAP_ODE_VERSION)
    message(FATAL_ERROR "ODE is said to be version ${ODE_PARALLEL_SAP_ODE_VERSION}, by its header <ode/version.h> "
                        "it is ${header_version}. ${ode_remedies}")
  endif()
  if(NOT header_precision STREQUAL library_precision)
    message(FATAL_ERROR "ODE's headers, as compiled here, are for ${header_precision} precision, its library has "
                        "${library_precision}. Look for dIDESINGLE or dIDEDOUBLE in the compiler flags, and for a second "
                        "ODE on this machine. ${ode_remedies}")
  endif()
  if(NOT library_precision STREQUAL ODE_PARALLEL_SAP_PRECISION)
    message(FATAL_ERROR "The ODE found has ${library_precision} precision, ODE_PARALLEL_SAP_PRECISION is "
                        "${ODE_PARALLEL_SAP_PRECISION}. Remedies: configure with "
                        "-DODE_PARALLEL_SAP_PRECISION=${library_precision}; or have an ODE of the other precision built "
                        "with -DODE_PARALLEL_SAP_ODE=SOURCE.")
  endif()
endif()

configure_file("${ode_cmake_dir}/config.h.in" "${ode_private_dir}/config.h")
run_with_ode(check_ode "The library of ODE ${ODE_PARALLEL_SAP_ODE_VERSION} and the private headers in ${ode_private_headers} do not fit together"
             check_says ode-private-headers PkgConfig::ODE_PARALLEL_SAP_LIBODE)

set(details "${ODE_PARALLEL_SAP_PRECISION} precision")
if(NOT ode_says)
  string(APPEND details ", not checked: cross-compiling")
elseif(ODE_HAS_TLS)
  string(APPEND details ", with thread-local collider caches, ${check_says}")
else()
  string(APPEND details ", without thread-local collider caches, ${check_says}")
endif()
message(STATUS "ODE ${ODE_PARALLEL_SAP_ODE_VERSION}: ${ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES} (${details})")
message(STATUS "ODE's private headers: ${ode_private_headers}")
set(ODE_PARALLEL_SAP_CHECKED "${fingerprint}" CACHE INTERNAL "What the check of ODE last passed for")
