# cmake -DPROGRAM=... -DOPTIONS=... -DEXIT_CODE=... -DTEXT=<regular expression> -P run_and_compare.cmake
execute_process(
  COMMAND ${PROGRAM} ${OPTIONS}
  RESULT_VARIABLE result
  OUTPUT_VARIABLE output
  ERROR_VARIABLE output)
message("${output}")
if(NOT result STREQUAL EXIT_CODE)
  message(FATAL_ERROR "the exit code is '${result}', not ${EXIT_CODE}")
endif()
if(NOT output MATCHES "${TEXT}")
  message(FATAL_ERROR "the output does not contain '${TEXT}'")
endif()
