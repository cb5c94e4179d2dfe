# cmake -DPROGRAM=<property-tests> -DWARNING=<of Catch2> -P no_tests.cmake
#
# The program must fail for a file without a test case, and not for any other reason.
execute_process(COMMAND "${PROGRAM}" --filenames-as-tags --warn "${WARNING}" "[#no_such_test]"
                RESULT_VARIABLE status OUTPUT_VARIABLE said ERROR_VARIABLE said)
message("${said}")
if(NOT status EQUAL 1 OR NOT said MATCHES "No test cases matched")
  message(FATAL_ERROR "It ended with ${status}, or does not say that nothing matched.")
endif()
