# Forks of ODE whose geoms are laid out otherwise: lookalikes of two, made from the source that the private headers are
# from. Every day random edits with the one whose geoms have no place for a slot's number; among the slow tests both, and
# the property tests with each of them, file by file.
if(CMAKE_CROSSCOMPILING OR NOT EXISTS "${ode_source_dir}/CMakeLists.txt" OR CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  message(STATUS "Tests with forks of ODE: not where programs are cross-compiled or sanitized, or ODE's source is not known")
  return()
endif()
set(here "${CMAKE_CURRENT_LIST_DIR}")

# add_fork_test(<kind> <name> <command>...): with what forks.<kind>.build made.
function(add_fork_test kind name)
  add_test(NAME forks.${kind}.${name} COMMAND ${ARGN})
  set_tests_properties(
    forks.${kind}.${name} PROPERTIES LABELS "cpu;forks" TIMEOUT 1800 FIXTURES_REQUIRED forks.${kind}
                                     SKIP_REGULAR_EXPRESSION "[*]Skipped"
                                     ENVIRONMENT "OMP_WAIT_POLICY=passive;ODE_PARALLEL_SAP_TEST_SCALE=0.1")
endfunction()

# add_fork(<kind> <edits> [<property test>...])
function(add_fork kind edits)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/forks/${kind}")
  set(targets long-run)
  if(ARGN)
    list(APPEND targets property-tests)
  endif()
  add_test(NAME forks.${kind}.build COMMAND "${here}/build.sh" ${kind} "${PROJECT_SOURCE_DIR}" "${ode_source_dir}"
                                            "${folder}" ${targets})
  set_tests_properties(forks.${kind}.build PROPERTIES LABELS "cpu;forks" COST 500 TIMEOUT 3600
                                                      FIXTURES_SETUP forks.${kind})
  set(long_run "${folder}/project/tests/fuzz/long-run")
  add_fork_test(${kind} long-run "${long_run}" ${edits})
  add_fork_test(${kind} long-run.grain "${long_run}" ${edits} 1000)
  set_property(TEST forks.${kind}.long-run.grain APPEND PROPERTY ENVIRONMENT ODE_PARALLEL_SAP_TEST_GRAIN=1
                                                              ODE_PARALLEL_SAP_THREADS=3)
  foreach(file IN LISTS ARGN)
    add_fork_test(${kind} ${file} "${CMAKE_CTEST_COMMAND}" --test-dir "${folder}/project" --output-on-failure
                  --no-tests=error -R "^${file}$")
  endforeach()
endfunction()

if(ODE_PARALLEL_SAP_SLOW_TESTS)
  set(files ${cpu_only} ${every_backend})
  list(TRANSFORM files REPLACE ".*/" "")
  add_fork(smaller 6000 ${files})
  add_fork(larger 6000 ${files})
else()
  add_fork(smaller 3000)
endif()
