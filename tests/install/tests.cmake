# An installed copy, used as users do; the symbols of the library.
set(here "${CMAKE_CURRENT_LIST_DIR}")
include(ProcessorCount)
ProcessorCount(cores)
set(user_environment "DEBFULLNAME=A Packager;DEBEMAIL=packager@debian.org;CMAKE_BUILD_PARALLEL_LEVEL=${cores};CC=${CMAKE_C_COMPILER};CXX=${CMAKE_CXX_COMPILER}")
get_target_property(library_type ode-parallel-sap TYPE)
option(ODE_PARALLEL_SAP_SLOW_TESTS "Also the tests that take minutes" OFF)

# For another build, with the same ODE.
set(same_ode
    "-DODE_PARALLEL_SAP_ODE=${ODE_PARALLEL_SAP_ODE}"
    "-DODE_PARALLEL_SAP_PRECISION=${ODE_PARALLEL_SAP_PRECISION}"
    "-DODE_SOURCE_DIR=${ODE_SOURCE_DIR}"
    "-DODE_PARALLEL_SAP_ODE_CACHE=${ODE_PARALLEL_SAP_ODE_CACHE}")

function(add_install_test name)
  add_test(NAME install.${name} COMMAND ${ARGN})
  set_tests_properties(install.${name} PROPERTIES LABELS "cpu;install" TIMEOUT 1200 SKIP_RETURN_CODE 77
                                                  ENVIRONMENT "${user_environment}")
endfunction()

if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  message(STATUS "Tests of the installation: not with sanitizers, which users would have to link")
  return()
endif()
add_install_test(arithmetic "${here}/arithmetic.sh" $<TARGET_FILE:ode-parallel-sap> "${CMAKE_OBJDUMP}")
if(CMAKE_CROSSCOMPILING)
  message(STATUS "Tests of the installation: not where programs are cross-compiled")
  return()
endif()
foreach(way find_package pkg-config)
  add_install_test(${way} "${here}/use.sh" "${PROJECT_BINARY_DIR}" ${way})
endforeach()
if(library_type STREQUAL "SHARED_LIBRARY")
  add_install_test(preload "${here}/use.sh" "${PROJECT_BINARY_DIR}" preload $<TARGET_FILE:spaces-program>)
  add_install_test(
    symbols "${here}/symbols.sh" $<TARGET_FILE:ode-parallel-sap>
    "${PROJECT_SOURCE_DIR}/space/include/ode_parallel_sap/parallel_sap_space.h"
    "${PROJECT_SOURCE_DIR}/space/preload/stand_ins.h" ${PROJECT_VERSION}
    $<TARGET_FILE:ode-parallel-sap-preload>)
  add_executable(unload-program "${here}/unload.c")
  target_include_directories(unload-program PRIVATE "${PROJECT_SOURCE_DIR}/space/include")
  target_link_libraries(unload-program PRIVATE PkgConfig::ODE_PARALLEL_SAP_LIBODE ${CMAKE_DL_LIBS})
  enable_warnings(unload-program)
  add_install_test(unload unload-program $<TARGET_FILE:ode-parallel-sap> $<TARGET_FILE:ode-parallel-sap-preload>)
endif()

if(TARGET docs)
  add_install_test(docs "${CMAKE_COMMAND}" --build "${PROJECT_BINARY_DIR}" --target docs)
else()
  message(STATUS "Test of the header's pages: none, there is no target docs (Debian: doxygen)")
endif()

if(ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  message(STATUS "Tests of a static build and of packages: not with an ODE of which only headers and library are known")
  return()
endif()

if(ODE_PARALLEL_SAP_PYTHON)
  set(conda "${ODE_PARALLEL_SAP_PYTHON}" "${here}/conda.py")
  add_install_test(conda-recipe ${conda} "${PROJECT_SOURCE_DIR}" ${PROJECT_VERSION} "${PROJECT_BINARY_DIR}/CMakeCache.txt")
else()
  add_install_test(conda-recipe ${CMAKE_COMMAND} -E echo "Skipped: needs python3")
  set_tests_properties(install.conda-recipe PROPERTIES SKIP_REGULAR_EXPRESSION "^Skipped")
endif()

# add_build(<name> <directory> <option>...): another build, not optimised so as to be quick, and for the
# prefix /usr, of the target that has to suffice for installing. It is what the tests that name it as a fixture work on.
function(add_build name directory)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
  add_install_test(
    ${name}.build "${CMAKE_CTEST_COMMAND}" --build-and-test "${PROJECT_SOURCE_DIR}" "${directory}"
    --build-generator "${CMAKE_GENERATOR}" --build-makeprogram "${CMAKE_MAKE_PROGRAM}"
    --build-target ode-parallel-sap-libraries --build-options
    -DBUILD_TESTING=OFF -DODE_PARALLEL_SAP_EXAMPLES=OFF -DCMAKE_INSTALL_PREFIX=/usr
    "-DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE}" "-DCMAKE_CXX_FLAGS_${type}=-O0"
    "-DCMAKE_C_COMPILER=${CMAKE_C_COMPILER}" "-DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}"
    ${same_ode} ${ARGN})
  set_tests_properties(install.${name}.build PROPERTIES FIXTURES_SETUP install.${name})
endfunction()

# add_static_build(<name> <directory> <option>...)
function(add_static_build name directory)
  add_build(${name} "${directory}" ${ARGN})
  foreach(way find_package pkg-config)
    add_install_test(${name}.${way} "${here}/use.sh" "${directory}" ${way})
    set_tests_properties(install.${name}.${way} PROPERTIES FIXTURES_REQUIRED install.${name})
  endforeach()
endfunction()
set(directory "${CMAKE_CURRENT_BINARY_DIR}/install")
add_static_build(static "${directory}/plain" -DBUILD_SHARED_LIBS=OFF -DODE_PARALLEL_SAP_CUDA=OFF)
if(CMAKE_CUDA_COMPILER AND ODE_PARALLEL_SAP_SLOW_TESTS)
  add_static_build(static-cuda "${directory}/cuda" -DBUILD_SHARED_LIBS=OFF -DODE_PARALLEL_SAP_CUDA=ON
                   "-DCMAKE_CUDA_COMPILER=${CMAKE_CUDA_COMPILER}" -DCMAKE_CUDA_ARCHITECTURES=75-real)
endif()

# With a static ODE the library is static unasked; a program with two ODEs is refused.
if(ODE_PARALLEL_SAP_ODE STREQUAL "SYSTEM" AND ODE_PARALLEL_SAP_PRECISION STREQUAL "DOUBLE")
  add_install_test(static-ode "${here}/static_ode.sh" "${PROJECT_SOURCE_DIR}" "${ode_source_dir}" "${directory}/static-ode"
                   "$<$<STREQUAL:${library_type},SHARED_LIBRARY>:$<TARGET_FILE:ode-parallel-sap>>")
  add_static_build(static-with-ode "${directory}/with-ode" -DODE_PARALLEL_SAP_CUDA=OFF "-DODE_SOURCE_DIR=${ode_source_dir}")
  set_tests_properties(install.static-ode PROPERTIES FIXTURES_SETUP install.static-ode)
  set_tests_properties(install.static-with-ode.build PROPERTIES FIXTURES_REQUIRED install.static-ode)
  set_property(TEST install.static-with-ode.build install.static-with-ode.find_package install.static-with-ode.pkg-config APPEND
               PROPERTY ENVIRONMENT "PKG_CONFIG_PATH=${directory}/static-ode/lib/pkgconfig")
endif()

# Most objects of the static build serve the shared one that is packaged, too.
if(ODE_PARALLEL_SAP_ODE STREQUAL "SYSTEM")
  add_build(package "${directory}/plain" -DBUILD_SHARED_LIBS=ON -DODE_PARALLEL_SAP_CUDA=OFF)
  set_tests_properties(install.package.build PROPERTIES DEPENDS "install.static.find_package;install.static.pkg-config")
  add_install_test(package "${here}/package.sh" "${PROJECT_SOURCE_DIR}" "${directory}/plain")
  set_tests_properties(install.package PROPERTIES FIXTURES_REQUIRED install.package FIXTURES_SETUP install.debian-source)
  if(ODE_PARALLEL_SAP_SLOW_TESTS)
    foreach(stage build use)
      add_install_test(debian-chroot.${stage} "${here}/clean_chroot.sh" ${stage} "${directory}/plain/debian-source"
                       "${directory}/debian-chroot")
    endforeach()
    set_tests_properties(
      install.debian-chroot.build PROPERTIES FIXTURES_REQUIRED install.debian-source FIXTURES_SETUP install.debian-chroot
                                             TIMEOUT 3600)
    set_tests_properties(install.debian-chroot.use PROPERTIES FIXTURES_REQUIRED install.debian-chroot TIMEOUT 3600)
  endif()
endif()
