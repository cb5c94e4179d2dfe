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
