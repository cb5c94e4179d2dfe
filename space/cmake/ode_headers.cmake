# ODE_PARALLEL_SAP_ODE=HEADERS: a library with its headers, as the user names them: a fork of ODE, or one
# that pkg-config does not know. No version is asked for: the check of the layout decides.
include_guard(GLOBAL)

set(ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS "" CACHE STRING
    "HEADERS: the directories of ODE's public headers, for <ode/ode.h> or <fork/ode/ode.h>")
set(ODE_PARALLEL_SAP_ODE_PRIVATE_DIRS "" CACHE STRING
    "HEADERS: the directories of its private headers, of what they include and, if it has one, of its config.h")
set(ODE_PARALLEL_SAP_ODE_LIBRARY "" CACHE FILEPATH "HEADERS: the library")
set(ODE_PARALLEL_SAP_ODE_DEFINITIONS "" CACHE STRING "HEADERS: what its users are compiled with, for instance dIDEDOUBLE")

# Fails unless `file` is in one of the directories that `variable` names.
function(expect_header variable file)
  foreach(directory IN LISTS ${variable})
    if(EXISTS "${directory}/${file}")
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "ODE_PARALLEL_SAP_ODE=HEADERS: ${variable}=${${variable}} has no ${file}.")
endfunction()

# Where the headers lie a folder deeper, <gazebo/ode/ode.h>, headers of ODE's own names include them.
set(ode_forwards "${PROJECT_BINARY_DIR}/ode-public")
file(REMOVE_RECURSE "${ode_forwards}")
file(MAKE_DIRECTORY "${ode_forwards}")
foreach(directory IN LISTS ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS)
  if(NOT EXISTS "${directory}/ode/ode.h")
    file(GLOB headers RELATIVE "${directory}" "${directory}/*/ode/*.h")
    foreach(header IN LISTS headers)
      get_filename_component(name "${header}" NAME)
      file(WRITE "${ode_forwards}/ode/${name}" "#include <${header}>\n")
    endforeach()
  endif()
endforeach()
set(ode_public_dirs ${ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS} "${ode_forwards}")
expect_header(ode_public_dirs ode/ode.h)
expect_header(ODE_PARALLEL_SAP_ODE_PRIVATE_DIRS collision_kernel.h)
if(NOT EXISTS "${ODE_PARALLEL_SAP_ODE_LIBRARY}")
  message(FATAL_ERROR "ODE_PARALLEL_SAP_ODE=HEADERS: there is no ODE_PARALLEL_SAP_ODE_LIBRARY=${ODE_PARALLEL_SAP_ODE_LIBRARY}.")
endif()

add_library(PkgConfig::ODE_PARALLEL_SAP_LIBODE INTERFACE IMPORTED GLOBAL)
set_target_properties(
  PkgConfig::ODE_PARALLEL_SAP_LIBODE
  PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${ode_public_dirs}"
             INTERFACE_LINK_LIBRARIES "${ODE_PARALLEL_SAP_ODE_LIBRARY}"
             INTERFACE_COMPILE_DEFINITIONS "${ODE_PARALLEL_SAP_ODE_DEFINITIONS}")
set(ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES "${ODE_PARALLEL_SAP_ODE_LIBRARY}")
set(ODE_PARALLEL_SAP_LIBODE_CFLAGS ${ODE_PARALLEL_SAP_ODE_INCLUDE_DIRS} ${ODE_PARALLEL_SAP_ODE_DEFINITIONS})

# Not every fork says which version it is of.
set(ODE_PARALLEL_SAP_ODE_VERSION "of a fork")
# A config.h of its own comes before the one made here.
set(ODE_PRIVATE_INCLUDE_DIRS ${ODE_PARALLEL_SAP_ODE_PRIVATE_DIRS} "${ode_private_dir}")
set(ode_source_dir "")
