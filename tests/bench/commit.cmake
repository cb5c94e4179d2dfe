# Writes commit.h if the commit has changed: cmake -DSOURCE=<dir> -DHEADER=<file> -P commit.cmake
execute_process(
  COMMAND git -C "${SOURCE}" describe --always --dirty --abbrev=10
  OUTPUT_VARIABLE commit
  OUTPUT_STRIP_TRAILING_WHITESPACE
  ERROR_QUIET
  RESULT_VARIABLE failed)
if(failed)
  set(commit unknown)
endif()
set(text "#define BENCH_COMMIT \"${commit}\"\n")
if(EXISTS "${HEADER}")
  file(READ "${HEADER}" old)
endif()
if(NOT text STREQUAL "${old}")
  file(WRITE "${HEADER}" "${text}")
endif()
