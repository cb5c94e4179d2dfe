# Another operating system, by Wine. Shown as skipped where cross compiler or Wine are missing.
if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux" OR CMAKE_CROSSCOMPILING OR ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  return()
endif()
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  message(STATUS "Tests on Windows: not with sanitizers, which MinGW-w64 does not have")
  return()
endif()
add_test(
  NAME mingw
  COMMAND
    "${CMAKE_CURRENT_LIST_DIR}/build_and_run.sh" "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_BINARY_DIR}/mingw"
    "-DODE_SOURCE_DIR=${ode_source_dir}" "-DODE_PARALLEL_SAP_ODE_CACHE=${ODE_PARALLEL_SAP_ODE_CACHE}"
    "-DODE_PARALLEL_SAP_PRECISION=${ODE_PARALLEL_SAP_PRECISION}")
set_tests_properties(mingw PROPERTIES LABELS "cpu;wine" COST 1000 SKIP_RETURN_CODE 77 TIMEOUT 3600)
