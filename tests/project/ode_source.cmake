# cmake -DMODULE=<ode_source.cmake> -DFOLDER=<an empty directory> -P ode_source.cmake
#
# Where ODE's source tree goes, and what becomes of it where the machine does what it rarely does: an archive and a
# repository that are down, a tree with other names.
cmake_minimum_required(VERSION 3.22)
set(PROJECT_SOURCE_DIR "${FOLDER}/source")
set(PROJECT_BINARY_DIR "${FOLDER}/build")
include("${MODULE}")

function(expect what got wanted)
  if(NOT "${got}" STREQUAL "${wanted}")
    message(SEND_ERROR "${what}: '${got}' instead of '${wanted}'")
  endif()
endfunction()

function(make_tree directory version license)
  file(WRITE "${directory}/configure.ac" "AC_INIT([ODE],[${version}],[ode@ode.org])\n")
  file(WRITE "${directory}/ode/src/collision_kernel.h" "")
  file(WRITE "${directory}/${license}" "")
endfunction()

# The source comes to the build directory, or to the directory that the user names; never to the project's own source tree.
function(check_cache)
  expect("the directory for ODE's source" "${ODE_PARALLEL_SAP_ODE_CACHE}" "${FOLDER}/build/.ode")
  foreach(cache IN ITEMS "${ODE_PARALLEL_SAP_ODE_CACHE}" "${FOLDER}/named by the user")
    set(ODE_PARALLEL_SAP_ODE_CACHE "${cache}")
    make_tree("${cache}/ode-0.16.98" 0.16.98 LICENSE-BSD)
    get_ode_source(0.16.98 directory)
    expect("the source that is there" "${directory}" "${cache}/ode-0.16.98")
  endforeach()
  file(GLOB written "${FOLDER}/source/*" "${FOLDER}/source/.*")
  expect("what is written into the source tree" "${written}" "")
endfunction()

function(check_license)
  foreach(name IN ITEMS LICENSE-BSD.TXT LICENSE-BSD)
    make_tree("${FOLDER}/tree-with-${name}" 0.16.2 ${name})
    find_ode_license("${FOLDER}/tree-with-${name}" license)
    expect("the licence" "${license}" "${FOLDER}/tree-with-${name}/${name}")
  endforeach()
endfunction()

# Upstream's first repository is down and its second one is the repository made here.
function(check_mirror)
  find_program(GIT_EXECUTABLE git)
  if(NOT GIT_EXECUTABLE)
    message(STATUS "Skipped: no git to fetch from upstream with (Debian: git)")
    return()
  endif()
  make_tree("${FOLDER}/mirror" 0.16.99 LICENSE-BSD)
  foreach(command IN ITEMS "init --quiet" "add ." "commit --quiet --message tree" "tag 0.16.99")
    separate_arguments(command)
    execute_process(COMMAND "${GIT_EXECUTABLE}" -c user.name=A -c user.email=a@localhost ${command}
                    WORKING_DIRECTORY "${FOLDER}/mirror" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  set(ENV{GIT_CONFIG_COUNT} 2)
  set(ENV{GIT_CONFIG_KEY_0} "url.file://${FOLDER}/mirror.insteadOf")
  set(ENV{GIT_CONFIG_VALUE_0} "https://github.com/odedevs/ode.git")
  set(ENV{GIT_CONFIG_KEY_1} "url.file://${FOLDER}/down/.insteadOf")
  set(ENV{GIT_CONFIG_VALUE_1} "https://bitbucket.org/")
  fetch_ode_from_upstream(0.16.99 "${FOLDER}/fetched")
  read_ode_source_version("${FOLDER}/fetched" version)
  expect("the version from the second repository" "${version}" 0.16.99)
endfunction()

file(REMOVE_RECURSE "${FOLDER}")
check_cache()
check_license()
check_mirror()
