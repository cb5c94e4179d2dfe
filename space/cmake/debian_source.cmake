# The target debian-source: a Debian source package of this tree, for dpkg-buildpackage, sbuild and the like, in
# debian-source/ of the build directory. Its packages are those of package.cmake, which includes this file. ODE's private
# headers go with it, as they are in the source tree that was found for the ODE of this machine, since nothing can be
# fetched where packages are built.
find_program(ODE_PARALLEL_SAP_DPKG_SOURCE dpkg-source)
mark_as_advanced(ODE_PARALLEL_SAP_DPKG_SOURCE)
set(ode_licenses "")
if(ode_source_dir)
  file(GLOB ode_licenses "${ode_source_dir}/LICENSE-BSD*")
endif()
if(NOT ODE_PARALLEL_SAP_DPKG_SOURCE OR NOT ODE_PARALLEL_SAP_ODE STREQUAL "SYSTEM" OR NOT ode_package OR NOT ode_licenses)
  message(STATUS "Debian source package: none, for want of dpkg-source (Debian: dpkg-dev), of an ODE that is a Debian package, "
                 "or of its licence in ODE's source tree")
  return()
endif()

set(debian_source_dir "${PROJECT_BINARY_DIR}/debian-source")
set(debian_dir "${debian_source_dir}/debian")
set(templates "${CMAKE_CURRENT_LIST_DIR}/debian")

# What stands in control and copyright. A continued line begins with a space there.
set(SUMMARY "${CPACK_PACKAGE_DESCRIPTION_SUMMARY}")
foreach(component IN ITEMS RUNTIME PRELOAD DEVELOPMENT)
  string(REPLACE "\n" "\n " ${component}_DESCRIPTION "${CPACK_COMPONENT_${component}_DESCRIPTION}")
endforeach()
set(ODE_VERSION "${ODE_PARALLEL_SAP_ODE_VERSION}")
string(REGEX MATCH "^(.*\\.)([0-9]+)$" matched "${ODE_VERSION}")
math(EXPR next "${CMAKE_MATCH_2} + 1")
set(NEXT_ODE_VERSION "${CMAKE_MATCH_1}${next}")
list(GET ode_licenses 0 ode_license)
read_debian_license("${ode_license}" ODE_LICENSE_TEXT)

file(REMOVE_RECURSE "${debian_dir}")
file(WRITE "${debian_dir}/source/format" "3.0 (quilt)\n")
configure_file("${templates}/changelog.in" "${debian_dir}/changelog" @ONLY)
configure_file("${templates}/source/control.in" "${debian_dir}/control" @ONLY)
configure_file("${templates}/source/rules.in" "${debian_dir}/rules" @ONLY
               FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
configure_file("${templates}/copyright.in" "${debian_source_dir}/copyright" @ONLY)
configure_file("${templates}/source/copyright_of_ode.in" "${debian_source_dir}/copyright_of_ode" @ONLY)
file(READ "${debian_source_dir}/copyright" copyright)
file(READ "${debian_source_dir}/copyright_of_ode" copyright_of_ode)
file(WRITE "${debian_dir}/copyright" "${copyright}${copyright_of_ode}")
set(PACKAGE "${preload_package}")
configure_file("${templates}/preload.lintian-overrides" "${debian_dir}/${preload_package}.lintian-overrides" @ONLY)
configure_file("${templates}/triggers" "${debian_dir}/${preload_package}.triggers" COPYONLY)
file(COPY "${templates}/source/tests" DESTINATION "${debian_dir}")

add_custom_target(
  debian-source
  COMMAND "${templates}/make_source.sh" ${PROJECT_VERSION} "${PROJECT_BINARY_DIR}/CPackSourceConfig.cmake" "${debian_dir}"
          "${ode_source_dir}" "${debian_source_dir}"
  COMMENT "Making the Debian source package"
  VERBATIM)
