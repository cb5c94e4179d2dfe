# Forks of ODE whose geoms are laid out otherwise: lookalikes of two, made from the source that the private headers are
# from. Every day the one whose geoms have no place for a slot's number, by random edits; the other one, and the
# property tests with both, among the slow tests.
if(CMAKE_CROSSCOMPILING OR NOT EXISTS "${ode_source_dir}/CMakeLists.txt" OR CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  message(STATUS "Tests with forks of ODE: not where programs are cross-compiled or sanitized, or ODE's source is not known")
  return()
endif()

# add_fork_test(<name> <kind> <edits> [<property tests>])
function(add_fork_test name kind)
  add_test(NAME forks.${name} COMMAND "${CMAKE_CURRENT_LIST_DIR}/build_and_run.sh" ${kind} "${PROJECT_SOURCE_DIR}"
                                      "${ode_source_dir}" "${CMAKE_CURRENT_BINARY_DIR}/forks/${name}" ${ARGN})
  set_tests_properties(forks.${name} PROPERTIES LABELS "cpu;forks" COST 500 TIMEOUT 3600)
endfunction()
add_fork_test(smaller smaller 3000)
if(ODE_PARALLEL_SAP_SLOW_TESTS)
  foreach(kind larger smaller)
    add_fork_test(${kind}.properties ${kind} 6000 "^(api|contract|edits|kept|lifecycle|narrow|order|pairs|planes|queries|silent)$")
  endforeach()
endif()
