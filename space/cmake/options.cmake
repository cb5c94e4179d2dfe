# Checks the values of the options and says what every target of this project is compiled with.

# Writes the upper-case value of an option back to `name`; any value but the ones listed is an error.
function(check_choice name)
  string(TOUPPER "${${name}}" value)
  if("${value}" IN_LIST ARGN)
    set(${name} "${value}" PARENT_SCOPE)
    return()
  endif()
  list(JOIN ARGN ", " choices)
  message(FATAL_ERROR "${name} is '${${name}}'; it can be one of: ${choices}.")
endfunction()

# CMake's usual spellings of a switch.
if(ODE_PARALLEL_SAP_CUDA MATCHES "^(1|TRUE|YES|Y|true|yes|y)$")
  set(ODE_PARALLEL_SAP_CUDA ON)
elseif(ODE_PARALLEL_SAP_CUDA MATCHES "^(0|FALSE|NO|N|false|no|n)$")
  set(ODE_PARALLEL_SAP_CUDA OFF)
endif()
check_choice(ODE_PARALLEL_SAP_CUDA AUTO ON OFF)

# Warnings for this project's own targets.
function(enable_warnings target)
  target_compile_options(
    ${target} PRIVATE "$<$<COMPILE_LANG_AND_ID:C,GNU,Clang,AppleClang>:-Wall;-Wextra>"
                      "$<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-Wall;-Wextra>")
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
    # Under a sanitizer GCC no longer sees that its own library initialises what it uses.
    target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-Wno-maybe-uninitialized>")
  endif()
endfunction()

# Where a cross-compiler has system headers of its own, it must not see the build machine's beside those of a package
# that is nothing but a folder of headers.
function(isolate_headers target folder)
  if(CMAKE_CROSSCOMPILING AND WIN32)
    get_target_property(directory ${target} INTERFACE_INCLUDE_DIRECTORIES)
    set(links "${PROJECT_BINARY_DIR}/headers")
    file(MAKE_DIRECTORY "${links}")
    file(CREATE_LINK "${directory}/${folder}" "${links}/${folder}" SYMBOLIC)
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${links}"
                                               INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${links}")
  endif()
endfunction()
