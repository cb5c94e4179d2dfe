# What `cmake --install` puts where: library, public header, CMake package, pkg-config file, licence;
# and the ODE that was built for it, if it was, so that the installed library finds it.
include(CMakePackageConfigHelpers)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/ode-parallel-sap")
set(pkgconfig_dir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

install(
  TARGETS ode-parallel-sap
  EXPORT ode-parallel-sap
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
if(TARGET ode-parallel-sap-preload)
  install(TARGETS ode-parallel-sap-preload LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT preload)
endif()
install(FILES "${PROJECT_SOURCE_DIR}/space/include/ode_parallel_sap/parallel_sap_space.h"
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ode_parallel_sap COMPONENT development)
if(ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS" AND EXISTS "${ode_forwards}")
  install(DIRECTORY "${ode_forwards}/ode" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ode_parallel_sap COMPONENT development)
endif()
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT license)

# The CMake package.
get_target_property(library_type ode-parallel-sap TYPE)
set(is_static OFF)
if(library_type STREQUAL "STATIC_LIBRARY")
  set(is_static ON)
endif()
set(needs_cuda_runtime OFF)
if(is_static AND TARGET ode-parallel-sap-cuda-objects)
  set(needs_cuda_runtime ON)
endif()
set(has_own_ode OFF)
if(ODE_PARALLEL_SAP_ODE_PREFIX)
  set(has_own_ode ON)
endif()
install(EXPORT ode-parallel-sap FILE ode-parallel-sapTargets.cmake NAMESPACE ode-parallel-sap::
        DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(
  "${CMAKE_CURRENT_LIST_DIR}/ode-parallel-sapConfig.cmake.in" "${PROJECT_BINARY_DIR}/ode-parallel-sapConfig.cmake"
  INSTALL_DESTINATION ${package_dir}
  PATH_VARS pkgconfig_dir)
write_basic_package_version_file(
  "${PROJECT_BINARY_DIR}/ode-parallel-sapConfigVersion.cmake" COMPATIBILITY SameMajorVersion)
install(FILES "${PROJECT_BINARY_DIR}/ode-parallel-sapConfig.cmake"
              "${PROJECT_BINARY_DIR}/ode-parallel-sapConfigVersion.cmake"
        DESTINATION ${package_dir} COMPONENT development)

# The pkg-config file; its paths are relative to itself, so that the prefix can be moved. A static
# library's users also need what the library links privately.
set(private_libraries "")
foreach(library IN LISTS OpenMP_CXX_LIBRARIES)
  get_filename_component(directory "${library}" DIRECTORY)
  get_filename_component(directory "${directory}" REALPATH)
  get_filename_component(name "${library}" NAME_WE)
  # Clang alone searches LLVM's own folder.
  if(directory IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES AND NOT name STREQUAL "libomp")
    string(REGEX REPLACE "^lib" "-l" library "${name}")
  endif()
  string(APPEND private_libraries " ${library}")
endforeach()
foreach(library IN LISTS CMAKE_CXX_IMPLICIT_LINK_LIBRARIES)
  if(library MATCHES "^(stdc\\+\\+|c\\+\\+|c\\+\\+abi|m)$" AND NOT private_libraries MATCHES "-l${CMAKE_MATCH_1}( |$)")
    string(APPEND private_libraries " -l${library}")
  endif()
endforeach()
if(needs_cuda_runtime)
  find_package(CUDAToolkit REQUIRED)
  string(APPEND private_libraries " -L${CUDAToolkit_LIBRARY_DIR} -lcudart_static -lrt -ldl")
endif()
set(libs "-L\${libdir} -lode-parallel-sap")
if(is_static)
  string(APPEND libs "${private_libraries}")
  if(LINKER_HAS_NODELETE)
    string(APPEND libs " -Wl,-z,nodelete")
  endif()
  set(private_libraries "")
endif()

# pkg-config does not know an ODE whose headers and library were named.
set(pc_requires "ode >= 0.16, ode < 0.17")
set(pc_cflags "")
if(WIN32 AND NOT is_static)
  set(pc_cflags " -DODE_PARALLEL_SAP_SHARED")
endif()
if(ODE_PARALLEL_SAP_ODE STREQUAL "HEADERS")
  set(pc_requires "")
  foreach(directory IN LISTS ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS)
    string(APPEND pc_cflags " -I\"${directory}\"")
  endforeach()
  foreach(definition IN LISTS ODE_PARALLEL_SAP_ODE_DEFINITIONS)
    string(APPEND pc_cflags " -D${definition}")
  endforeach()
  string(APPEND libs " \"${ODE_PARALLEL_SAP_ODE_LIBRARY}\"")
endif()

# A directory of the installation, in terms of the pkg-config file's own.
function(relate_to_pkgconfig_dir directory result)
  if(IS_ABSOLUTE "${directory}" OR IS_ABSOLUTE "${pkgconfig_dir}")
    get_filename_component(path "${directory}" ABSOLUTE BASE_DIR "${CMAKE_INSTALL_PREFIX}")
  else()
    file(RELATIVE_PATH path "/prefix/${pkgconfig_dir}" "/prefix/${directory}")
    string(PREPEND path "\${pcfiledir}/")
    string(REGEX REPLACE "/$" "" path "${path}")
  endif()
  set(${result} "${path}" PARENT_SCOPE)
endfunction()
relate_to_pkgconfig_dir("." pc_prefix)
relate_to_pkgconfig_dir("${CMAKE_INSTALL_LIBDIR}" pc_libdir)
relate_to_pkgconfig_dir("${CMAKE_INSTALL_INCLUDEDIR}" pc_includedir)
configure_file("${CMAKE_CURRENT_LIST_DIR}/ode-parallel-sap.pc.in" "${PROJECT_BINARY_DIR}/ode-parallel-sap.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/ode-parallel-sap.pc" DESTINATION ${pkgconfig_dir} COMPONENT development)

# The ODE that was built for this library.
if(has_own_ode)
  file(GLOB libraries "${ODE_PARALLEL_SAP_ODE_PREFIX}/lib/libode*")
  install(FILES ${libraries} DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime)
  install(DIRECTORY "${ODE_PARALLEL_SAP_ODE_PREFIX}/include/ode" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
          COMPONENT development)
  find_ode_license("${ode_source_dir}" ode_license)
  install(FILES "${ode_license}" DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME LICENSE-ODE
          COMPONENT runtime)
  file(READ "${ODE_PARALLEL_SAP_ODE_PREFIX}/lib/pkgconfig/ode.pc" ode_pc)
  string(REGEX REPLACE "(^|\n)prefix=[^\n]*" "\\1prefix=${pc_prefix}" ode_pc "${ode_pc}")
  string(REGEX REPLACE "\nlibdir=[^\n]*" "\nlibdir=${pc_libdir}" ode_pc "${ode_pc}")
  string(REGEX REPLACE "\nincludedir=[^\n]*" "\nincludedir=${pc_includedir}" ode_pc "${ode_pc}")
  file(WRITE "${PROJECT_BINARY_DIR}/ode.pc" "${ode_pc}")
  install(FILES "${PROJECT_BINARY_DIR}/ode.pc" DESTINATION ${pkgconfig_dir} COMPONENT development)
  if(APPLE)
    set_property(TARGET ode-parallel-sap APPEND PROPERTY INSTALL_RPATH "@loader_path")
  else()
    set_property(TARGET ode-parallel-sap APPEND PROPERTY INSTALL_RPATH "$ORIGIN")
  endif()
endif()
