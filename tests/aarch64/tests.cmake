# Another processor, emulated. Shown as skipped where cross compiler or emulator are missing.
if(CMAKE_CROSSCOMPILING OR CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64" OR ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  return()
endif()
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  message(STATUS "Tests on 64-bit ARM: not with sanitizers, which QEMU does not run")
  return()
endif()
add_test(
  NAME aarch64
  COMMAND
    "${CMAKE_CURRENT_LIST_DIR}/build_and_run.sh" "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_BINARY_DIR}/aarch64"
    -DODE_PARALLEL_SAP_ODE=SOURCE "-DODE_SOURCE_DIR=${ode_source_dir}" "-DODE_PARALLEL_SAP_ODE_CACHE=${ODE_PARALLEL_SAP_ODE_CACHE}"
    "-DODE_PARALLEL_SAP_PRECISION=${ODE_PARALLEL_SAP_PRECISION}")
# The longest of all: begun first.
set_tests_properties(aarch64 PROPERTIES LABELS "cpu;qemu" COST 1000 SKIP_RETURN_CODE 77 TIMEOUT 3600)
