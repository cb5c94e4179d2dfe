# The project itself: as a part of another one, with ODE's source from wherever, its scripts, which of its
# rooms include which, and the files that its documents name.
set(here "${CMAKE_CURRENT_LIST_DIR}")

function(add_project_test name)
  add_test(NAME project.${name} COMMAND ${ARGN})
  set_tests_properties(project.${name} PROPERTIES LABELS "cpu;project" TIMEOUT 1200 SKIP_RETURN_CODE 77
                                                  ENVIRONMENT "${user_environment}")
endfunction()

add_project_test(
  no-tests "${CMAKE_COMMAND}" -DPROGRAM=$<TARGET_FILE:property-tests> -DWARNING=${warn_of_no_tests}
  -P "${here}/no_tests.cmake")
add_project_test(scripts "${here}/scripts.sh" "${PROJECT_SOURCE_DIR}")
add_project_test(
  ode-source "${CMAKE_COMMAND}" "-DMODULE=${PROJECT_SOURCE_DIR}/space/cmake/ode_source.cmake"
  "-DFOLDER=${CMAKE_CURRENT_BINARY_DIR}/project/ode-source" -P "${here}/ode_source.cmake")
add_project_test(debian-source "${here}/debian_source.sh" "${PROJECT_SOURCE_DIR}/space/cmake/fetch_debian_source.sh")
add_project_test(includes "${here}/../documents/includes.sh" "${PROJECT_SOURCE_DIR}")
add_project_test(documents "${here}/../documents/documents.sh" "${PROJECT_SOURCE_DIR}")
add_project_test(format "${here}/../documents/format.sh" "${PROJECT_SOURCE_DIR}")
if(ODE_PARALLEL_SAP_PYTHON)
  add_project_test(ablation "${ODE_PARALLEL_SAP_PYTHON}" "${here}/../bench/ablation.py" check)
  add_project_test(tables "${ODE_PARALLEL_SAP_PYTHON}" "${here}/../bench/table.py" --check)
endif()
add_project_test(skipped "${here}/skipped.sh" "${PROJECT_SOURCE_DIR}")

# The public header compiles without a warning in all languages of its users. C89 has no `long long`, but compilers do.
add_custom_target(public-header)
set(C_source "${here}/header.c")
set(C_standards 90 99 11)
set(CXX_source "${here}/header.cpp")
set(CXX_standards 11 17)
foreach(language C CXX)
  foreach(standard IN LISTS ${language}_standards)
    set(target public-header-${language}${standard})
    add_library(${target} OBJECT EXCLUDE_FROM_ALL "${${language}_source}")
    set_target_properties(${target} PROPERTIES ${language}_STANDARD ${standard} ${language}_EXTENSIONS OFF)
    target_link_libraries(${target} PRIVATE ode-parallel-sap::ode-parallel-sap)
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wno-long-long -Werror)
    add_dependencies(public-header ${target})
  endforeach()
endforeach()
add_project_test(header "${CMAKE_COMMAND}" --build "${PROJECT_BINARY_DIR}" --target public-header)

if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize=" AND NOT ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  add_project_test(
    subproject "${here}/subproject.sh" "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_BINARY_DIR}/project/subproject"
    -G "${CMAKE_GENERATOR}" -DODE_PARALLEL_SAP_CUDA=OFF ${same_ode})
  # README's way to install, where nothing is there but what it says is needed.
  add_project_test(
    needs-no-more "${CMAKE_COMMAND}" -S "${PROJECT_SOURCE_DIR}" --preset install
    -B "${CMAKE_CURRENT_BINARY_DIR}/project/needs-no-more" -G "${CMAKE_GENERATOR}"
    -DCMAKE_DISABLE_FIND_PACKAGE_Catch2=ON -DCMAKE_DISABLE_FIND_PACKAGE_CLI11=ON ${same_ode})
  # What only builds with assertions promise: two threads in one space are found.
  add_project_test(
    debug "${CMAKE_CTEST_COMMAND}" --build-and-test "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_BINARY_DIR}/project/debug"
    --build-generator "${CMAKE_GENERATOR}" --build-target property-tests --build-options -DCMAKE_BUILD_TYPE=Debug
    -DODE_PARALLEL_SAP_PROPERTY_TESTS=contract -DODE_PARALLEL_SAP_EXAMPLES=OFF -DODE_PARALLEL_SAP_CUDA=OFF ${same_ode}
    --test-command "${CMAKE_CURRENT_BINARY_DIR}/project/debug/tests/property-tests" "Two threads*" --warn NoTests)
  set(property_tests ${cpu_only} ${every_backend})
  list(TRANSFORM property_tests REPLACE ".*/" "")
  list(JOIN property_tests "|" property_tests)
  # ODE as its own CMake project builds releases, for vcpkg, conda and Windows too: without assertions.
  add_project_test(
    no-assertions "${CMAKE_CTEST_COMMAND}" --build-and-test "${PROJECT_SOURCE_DIR}"
    "${CMAKE_CURRENT_BINARY_DIR}/project/no-assertions" --build-generator "${CMAKE_GENERATOR}" --build-target property-tests
    --build-options -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG" -DODE_PARALLEL_SAP_EXAMPLES=OFF
    -DODE_PARALLEL_SAP_CUDA=OFF ${same_ode} -DODE_PARALLEL_SAP_ODE=SOURCE
    --test-command "${CMAKE_CTEST_COMMAND}" --output-on-failure --no-tests=error -R "^(${property_tests})$")
  set_property(
    TEST project.no-assertions APPEND
    PROPERTY ENVIRONMENT ODE_PARALLEL_SAP_TEST_ONLY=cpu ODE_PARALLEL_SAP_TEST_SCALE=0.1 OMP_WAIT_POLICY=passive)
  set_tests_properties(project.no-assertions PROPERTIES COST 500 TIMEOUT 3600)
endif()
