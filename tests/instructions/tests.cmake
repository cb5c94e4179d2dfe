# What the sweep takes with each instruction set, in instructions: numbers that do not depend on what else a machine does.
add_executable(sweep-count "${CMAKE_CURRENT_LIST_DIR}/sweep_count.cpp" $<TARGET_OBJECTS:ode-parallel-sap-core>)
target_include_directories(sweep-count PRIVATE "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
target_link_libraries(sweep-count PRIVATE test-support OpenMP::OpenMP_CXX)
enable_warnings(sweep-count)

# Vectors must save instructions. Neither valgrind nor QEMU runs what is built with a sanitizer, and valgrind takes long for
# what is not optimised.
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=" OR CMAKE_BUILD_TYPE STREQUAL "Debug")
  message(STATUS "Test of instructions: neither with sanitizers nor in Debug builds")
  return()
endif()
if(ODE_PARALLEL_SAP_PYTHON)
  add_test(NAME instructions COMMAND "${ODE_PARALLEL_SAP_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/count.py"
                                     $<TARGET_FILE:sweep-count>)
else()
  add_test(NAME instructions COMMAND ${CMAKE_COMMAND} -E echo "SKIPPED: needs python3")
endif()
set_tests_properties(instructions PROPERTIES LABELS cpu SKIP_RETURN_CODE 77 SKIP_REGULAR_EXPRESSION "SKIPPED: needs"
                                             TIMEOUT 600)
