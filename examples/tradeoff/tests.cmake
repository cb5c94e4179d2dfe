# The study in a few seconds: what it measures, writes, resumes and concludes.
if(ODE_PARALLEL_SAP_PRECISION STREQUAL "DOUBLE")
  find_program(ODE_PARALLEL_SAP_PYTHON python3 HINTS /usr/bin) # the system's: it has the system's matplotlib
  if(ODE_PARALLEL_SAP_PYTHON)
    add_test(NAME examples.tradeoff COMMAND "${ODE_PARALLEL_SAP_PYTHON}" "${CMAKE_CURRENT_SOURCE_DIR}/smoke_test.py"
                                            $<TARGET_FILE:tradeoff-point> $<TARGET_FILE:own-scene>)
    add_test(NAME examples.tradeoff.pieces COMMAND "${ODE_PARALLEL_SAP_PYTHON}"
                                                   "${CMAKE_CURRENT_SOURCE_DIR}/pieces_test.py"
                                                   $<TARGET_FILE:tradeoff-point>)
    add_test(NAME examples.tradeoff.stats COMMAND "${ODE_PARALLEL_SAP_PYTHON}"
                                                  "${CMAKE_CURRENT_SOURCE_DIR}/stats_test.py")
    add_test(NAME examples.tradeoff.readme COMMAND "${ODE_PARALLEL_SAP_PYTHON}"
                                                   "${CMAKE_CURRENT_SOURCE_DIR}/readme_test.py")
    set_tests_properties(examples.tradeoff.pieces examples.tradeoff.readme examples.tradeoff.stats
                         PROPERTIES LABELS examples TIMEOUT 300 SKIP_RETURN_CODE 77)
  else()
    add_test(NAME examples.tradeoff COMMAND ${CMAKE_COMMAND} -E echo "Skipped: needs Debian's python3")
    set_tests_properties(examples.tradeoff PROPERTIES SKIP_REGULAR_EXPRESSION Skipped)
  endif()
  set_tests_properties(examples.tradeoff PROPERTIES LABELS examples TIMEOUT 300 SKIP_RETURN_CODE 77)
endif()

# ODE's demo in the harness.
if(TARGET buggy AND ODE_PARALLEL_SAP_PYTHON)
  add_test(NAME examples.tradeoff.buggy COMMAND "${ODE_PARALLEL_SAP_PYTHON}"
                                                "${CMAKE_CURRENT_SOURCE_DIR}/buggy/buggy_test.py" $<TARGET_FILE:buggy>)
else()
  add_test(NAME examples.tradeoff.buggy COMMAND ${CMAKE_COMMAND} -E echo
                                                "Skipped: needs the demos of ODE's source, double precision and python3")
  set_tests_properties(examples.tradeoff.buggy PROPERTIES SKIP_REGULAR_EXPRESSION Skipped)
endif()
set_tests_properties(examples.tradeoff.buggy PROPERTIES LABELS examples TIMEOUT 300 SKIP_RETURN_CODE 77)

add_executable(harness-test harness_test.cpp)
target_compile_features(harness-test PRIVATE cxx_std_17)
target_link_libraries(harness-test PRIVATE ode-parallel-sap::ode-parallel-sap)
enable_warnings(harness-test)
add_test(NAME examples.tradeoff.harness COMMAND harness-test)
set_tests_properties(examples.tradeoff.harness PROPERTIES LABELS examples)

add_test(NAME examples.tradeoff.precision COMMAND tradeoff-point precision)
string(TOLOWER "${ODE_PARALLEL_SAP_PRECISION}" precision)
set_tests_properties(examples.tradeoff.precision PROPERTIES LABELS examples PASS_REGULAR_EXPRESSION "^${precision}\n$")
add_test(NAME examples.tradeoff.own-scene COMMAND own-scene --seconds 2 --dt 0.02)
set_tests_properties(examples.tradeoff.own-scene PROPERTIES LABELS examples PASS_REGULAR_EXPRESSION "observed_sag")
