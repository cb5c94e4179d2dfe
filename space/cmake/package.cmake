# Packages by CPack, from a build for the prefix /usr (the preset `package`):
#
#     libode-parallel-sap0       the library
#     ode-parallel-sap-preload   the preload library
#     libode-parallel-sap-dev    header, CMake package, pkg-config file
#
# the source archive, by `cpack --config CPackSourceConfig.cmake`, and the Debian source package
# (debian_source.cmake). Version and SONAME are those of project(). The maintainer is taken from
# DEBFULLNAME and DEBEMAIL, as Debian's tools do.
set(runtime_package "libode-parallel-sap${PROJECT_VERSION_MAJOR}")
set(preload_package "ode-parallel-sap-preload")
set(development_package "libode-parallel-sap-dev")
set(package_release 0local1)  # not from Debian
set(package_version "${PROJECT_VERSION}-${package_release}")

set(maintainer "ode-parallel-sap authors")
if(DEFINED ENV{DEBFULLNAME})
  set(maintainer "$ENV{DEBFULLNAME}")
endif()
set(address "root@localhost.localdomain")
if(DEFINED ENV{DEBEMAIL})
  set(address "$ENV{DEBEMAIL}")
endif()

set(CPACK_PACKAGE_NAME "${PROJECT_NAME}")
set(CPACK_PACKAGE_VENDOR "${maintainer}")
set(CPACK_PACKAGE_CONTACT "${maintainer} <${address}>")
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL runtime preload development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${package_release})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/space")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "exact parallel broad phase for the Open Dynamics Engine")
string(CONCAT about "ODE finds the pairs of geoms that may touch in a dSpace. This one reports\n"
                    "exactly the pairs of dSimpleSpace, in one fixed order, on all cores or a\n"
                    "GPU, in time linear in geoms and pairs.\n.\n")

# dpkg-shlibdeps takes any later ODE for good; what the library is tied to, private headers, is that of 0.16.
set(ode_package "")
foreach(library IN LISTS ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES)
  get_filename_component(library "${library}" REALPATH)
  if(library MATCHES "/libode\\.")
    execute_process(COMMAND dpkg-query --search "${library}" OUTPUT_VARIABLE owner ERROR_QUIET)
    string(REGEX MATCH "^[^:, ]+" ode_package "${owner}")
  endif()
endforeach()
if(ode_package)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "${ode_package} (<< 2:0.17~)")
endif()

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME "${runtime_package}")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
# Not made by CPack, which warns that the preload library has no version.
file(WRITE "${PROJECT_BINARY_DIR}/debian/shlibs"
     "libode-parallel-sap ${PROJECT_VERSION_MAJOR} ${runtime_package} (= ${package_version})\n")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA "${CMAKE_CURRENT_LIST_DIR}/debian/triggers;${PROJECT_BINARY_DIR}/debian/shlibs")
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "${about}This package has the library.")

set(CPACK_DEBIAN_PRELOAD_PACKAGE_NAME "${preload_package}")
set(CPACK_DEBIAN_PRELOAD_PACKAGE_SECTION utils)
set(CPACK_DEBIAN_PRELOAD_PACKAGE_CONTROL_EXTRA "${CMAKE_CURRENT_LIST_DIR}/debian/triggers")
set(CPACK_DEBIAN_PRELOAD_PACKAGE_DEPENDS "${runtime_package} (= ${package_version})")
set(CPACK_COMPONENT_PRELOAD_DESCRIPTION "${about}This package gives it to programs that are not recompiled:\n LD_PRELOAD=libode-parallel-sap-preload.so program")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME "${development_package}")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "${runtime_package} (= ${package_version}), libode-dev (>= 2:0.16), libode-dev (<< 2:0.17~), pkg-config")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "${about}This package has the header, the CMake package and the pkg-config file.")

# A file with a licence as Debian's copyright files have it: lines begin with a space, empty ones are a dot.
function(read_debian_license file result)
  file(READ "${file}" license)
  string(STRIP "${license}" license)
  string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
  string(REGEX REPLACE "\n" "\n " license "${license}")
  set(${result} "${license}" PARENT_SCOPE)
endfunction()
set(MAINTAINER "${CPACK_PACKAGE_CONTACT}")
set(PACKAGE_VERSION "${package_version}")
string(TIMESTAMP DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH, if it is set
read_debian_license("${PROJECT_SOURCE_DIR}/LICENSE" LICENSE_TEXT)

# What Debian wants of every package, and a plain installation does without; in a source package its tools see to it.
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr" AND NOT EXISTS "${PROJECT_SOURCE_DIR}/debian/rules")
  configure_file("${CMAKE_CURRENT_LIST_DIR}/debian/changelog.in" "${PROJECT_BINARY_DIR}/debian/changelog")
  configure_file("${CMAKE_CURRENT_LIST_DIR}/debian/copyright.in" "${PROJECT_BINARY_DIR}/debian/copyright")
  execute_process(COMMAND gzip -9nc "${PROJECT_BINARY_DIR}/debian/changelog"
                  OUTPUT_FILE "${PROJECT_BINARY_DIR}/debian/changelog.Debian.gz")
  foreach(component IN ITEMS runtime preload development)
    install(FILES "${PROJECT_BINARY_DIR}/debian/changelog.Debian.gz" "${PROJECT_BINARY_DIR}/debian/copyright"
            DESTINATION "${CMAKE_INSTALL_DATAROOTDIR}/doc/${${component}_package}"
            COMPONENT ${component} EXCLUDE_FROM_ALL)
  endforeach()
  foreach(component IN ITEMS runtime preload)
    set(PACKAGE "${${component}_package}")
    set(overrides "")
    foreach(cause IN ITEMS cpack ${component})
      if(EXISTS "${CMAKE_CURRENT_LIST_DIR}/debian/${cause}.lintian-overrides")
        file(READ "${CMAKE_CURRENT_LIST_DIR}/debian/${cause}.lintian-overrides" override)
        string(APPEND overrides "${override}")
      endif()
    endforeach()
    string(CONFIGURE "${overrides}" overrides @ONLY)
    file(WRITE "${PROJECT_BINARY_DIR}/debian/overrides/${PACKAGE}" "${overrides}")
    install(FILES "${PROJECT_BINARY_DIR}/debian/overrides/${PACKAGE}"
            DESTINATION "${CMAKE_INSTALL_DATAROOTDIR}/lintian/overrides" COMPONENT ${component} EXCLUDE_FROM_ALL)
  endforeach()
endif()

set(CPACK_SOURCE_GENERATOR TGZ)
set(CPACK_SOURCE_PACKAGE_FILE_NAME "${PROJECT_NAME}-${PROJECT_VERSION}")
# Only what is in the repository: no build directory, no fetched ODE.
set(CPACK_SOURCE_IGNORE_FILES "/\\.git/" "/\\.git$" "/build[^/]*/" "/\\.cache/" "/\\.carry/" "/__pycache__/")
include(CPack)
include("${CMAKE_CURRENT_LIST_DIR}/debian_source.cmake")
