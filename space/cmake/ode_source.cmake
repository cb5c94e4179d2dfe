# ODE's source trees, and libraries built from them, in a directory that build directories may share.
include_guard(GLOBAL)

set(ode_cmake_dir "${CMAKE_CURRENT_LIST_DIR}")
set(ODE_PARALLEL_SAP_ODE_CACHE "${PROJECT_BINARY_DIR}/.ode" CACHE PATH
    "Where ODE's source is fetched to, and built if need be; several build directories may name the same")

# The version of the ODE source tree in a directory; empty if there is none.
function(read_ode_source_version directory result)
  set(version "")
  if(EXISTS "${directory}/ode/src/collision_kernel.h" AND EXISTS "${directory}/configure.ac")
    file(STRINGS "${directory}/configure.ac" line REGEX "^AC_INIT" LIMIT_COUNT 1)
    string(REGEX MATCH "[0-9]+\\.[0-9]+(\\.[0-9]+)?" version "${line}")
  endif()
  set(${result} "${version}" PARENT_SCOPE)
endfunction()

# The file of an ODE source tree with the licence that is chosen here, by the names it has had.
function(find_ode_license directory result)
  foreach(name IN ITEMS LICENSE-BSD.TXT LICENSE-BSD)
    if(EXISTS "${directory}/${name}")
      set(${result} "${directory}/${name}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "${directory} has no LICENSE-BSD.TXT or LICENSE-BSD to be installed with ODE.")
endfunction()

# Debian's source package of that version, unpacked into a directory.
function(fetch_ode_from_debian version directory)
  message(STATUS "Fetching the source of ODE ${version} from the Debian archive")
  execute_process(COMMAND sh "${ode_cmake_dir}/fetch_debian_source.sh" ${version} "${directory}.download" TIMEOUT 600)
  file(GLOB tarball "${directory}.download/*.orig.tar.*")
  if(tarball)
    file(ARCHIVE_EXTRACT INPUT "${tarball}" DESTINATION "${directory}.download/tree")
    file(GLOB tree "${directory}.download/tree/*")
    file(RENAME "${tree}" "${directory}")
  endif()
  file(REMOVE_RECURSE "${directory}.download")
endfunction()

# The first of upstream's repositories that can be reached, at the tag of that version, cloned into a directory.
function(fetch_ode_from_upstream version directory)
  find_package(Git QUIET)
  if(NOT Git_FOUND)
    message(STATUS "No git to fetch ODE ${version} from upstream with")
    return()
  endif()
  foreach(repository IN ITEMS https://bitbucket.org/odedevs/ode.git https://github.com/odedevs/ode.git)
    message(STATUS "Fetching the source of ODE ${version} from ${repository}")
    execute_process(
      COMMAND "${CMAKE_COMMAND}" -E env GIT_TERMINAL_PROMPT=0 "${GIT_EXECUTABLE}" -c advice.detachedHead=false
              clone --quiet --depth 1 --branch ${version} ${repository} "${directory}"
      TIMEOUT 600
      RESULT_VARIABLE status)
    if(status EQUAL 0)
      return()
    endif()
    file(REMOVE_RECURSE "${directory}")
  endforeach()
endfunction()

# Sets `result` to a directory with ODE's source of exactly that version: the cached one, or else a
# newly fetched one. Empty if it is not to be had.
function(get_ode_source version result)
  set(cache "${ODE_PARALLEL_SAP_ODE_CACHE}")
  file(MAKE_DIRECTORY "${cache}")
  set(directory "${cache}/ode-${version}")
  set(${result} "${directory}" PARENT_SCOPE)

  file(LOCK "${cache}/lock" GUARD FUNCTION TIMEOUT 600)
  foreach(fetch IN ITEMS nothing fetch_ode_from_debian fetch_ode_from_upstream)
    if(NOT fetch STREQUAL "nothing")
      string(RANDOM LENGTH 8 suffix)
      cmake_language(CALL ${fetch} ${version} "${directory}.${suffix}")
      read_ode_source_version("${directory}.${suffix}" fetched)
      if(fetched VERSION_EQUAL version)
        file(REMOVE_RECURSE "${directory}")
        file(RENAME "${directory}.${suffix}" "${directory}")
      endif()
      file(REMOVE_RECURSE "${directory}.${suffix}")
    endif()
    read_ode_source_version("${directory}" found)
    if(found VERSION_EQUAL version)
      return()
    endif()
  endforeach()
  set(${result} "" PARENT_SCOPE)
endfunction()

function(run_or_fail what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${what} failed (${status}):\n${output}")
  endif()
endfunction()

# Builds ODE by its own CMake, with thread-local storage and libccd, and sets `result` to the prefix it was
# installed to. It is a shared library, but on Windows, where ODE's DLL exports no class, a static one. A source tree out of the cache is built once for each precision,
# compiler and build type; one that the user named is brought up to date by every configure.
function(build_ode source precision result)
  # ODE's own assertions are in Debug builds only.
  set(type Release)
  if(CMAKE_BUILD_TYPE STREQUAL "Debug")
    set(type Debug)
  endif()
  set(settings
      "-DCMAKE_BUILD_TYPE=${type}"
      "-DCMAKE_C_COMPILER=${CMAKE_C_COMPILER}"
      "-DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}"
      "-DCMAKE_INSTALL_LIBDIR=lib"
      "-DCMAKE_POLICY_VERSION_MINIMUM=3.5"
      "-DODE_WITH_OU=ON"
      "-DODE_WITH_LIBCCD=ON"
      "-DODE_WITH_DEMOS=OFF"
      "-DODE_WITH_TESTS=OFF")
  if(WIN32)
    # ODE includes <Windows.h>; MinGW-w64's name is lower-case, and other systems tell them apart.
    set(lower_case "${ODE_PARALLEL_SAP_ODE_CACHE}/windows-h")
    file(WRITE "${lower_case}/Windows.h" "#include <windows.h>\n")
    list(APPEND settings -DBUILD_SHARED_LIBS=OFF "-DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS} -I\"${lower_case}\"")
  else()
    list(APPEND settings -DBUILD_SHARED_LIBS=ON)
  endif()
  if(precision STREQUAL "DOUBLE")
    list(APPEND settings "-DODE_DOUBLE_PRECISION=ON")
  else()
    list(APPEND settings "-DODE_DOUBLE_PRECISION=OFF")
  endif()
  if(CMAKE_TOOLCHAIN_FILE)
    list(APPEND settings "-DCMAKE_TOOLCHAIN_FILE=${CMAKE_TOOLCHAIN_FILE}")
  endif()

  read_ode_source_version("${source}" version)
  set(cache "${ODE_PARALLEL_SAP_ODE_CACHE}")
  if("${source}" STREQUAL "${cache}/ode-${version}")
    set(base "${cache}")
  else()
    set(base "${PROJECT_BINARY_DIR}/ode")
    file(MAKE_DIRECTORY "${base}")
  endif()
  string(SHA256 key "${source} ${settings} ${CMAKE_CXX_COMPILER_VERSION}")
  string(SUBSTRING "${key}" 0 12 key)
  string(TOLOWER "ode-${version}-${precision}-${CMAKE_CXX_COMPILER_ID}-${type}-${key}" name)
  set(prefix "${base}/${name}")
  set(${result} "${prefix}" PARENT_SCOPE)

  file(LOCK "${base}/lock" GUARD FUNCTION TIMEOUT 1200)
  if(EXISTS "${prefix}/complete" AND base STREQUAL cache)
    return()
  endif()
  message(STATUS "Building ODE ${version}, ${precision} precision, ${type}, in ${prefix}")
  set(build "${prefix}/build")
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  if(DEFINED ENV{CMAKE_BUILD_PARALLEL_LEVEL})
    set(cores "$ENV{CMAKE_BUILD_PARALLEL_LEVEL}")
  endif()
  run_or_fail("Configuring ODE ${version}" "${CMAKE_COMMAND}" -S "${source}" -B "${build}" -G "${CMAKE_GENERATOR}"
              "-DCMAKE_MAKE_PROGRAM=${CMAKE_MAKE_PROGRAM}" "-DCMAKE_INSTALL_PREFIX=${prefix}" ${settings})
  run_or_fail("Building ODE ${version}" "${CMAKE_COMMAND}" --build "${build}" --config ${type} --parallel ${cores})
  run_or_fail("Installing ODE ${version}" "${CMAKE_COMMAND}" --install "${build}" --config ${type})
  # On Windows the library's name has the precision in it, which ode.pc leaves out.
  file(GLOB static_library "${prefix}/lib/libode_*.a")
  if(static_library)
    file(RENAME "${static_library}" "${prefix}/lib/libode.a")
  endif()
  # ODE writes the prefix as it is, and a space in it ends the path; pkg-config quotes its own variable.
  file(READ "${prefix}/lib/pkgconfig/ode.pc" ode_pc)
  string(REGEX REPLACE "(^|\n)prefix=[^\n]*" "\\1prefix=\${pcfiledir}/../.." ode_pc "${ode_pc}")
  file(WRITE "${prefix}/lib/pkgconfig/ode.pc" "${ode_pc}")
  if(base STREQUAL cache)
    file(REMOVE_RECURSE "${build}")
  endif()
  file(TOUCH "${prefix}/complete")
endfunction()
