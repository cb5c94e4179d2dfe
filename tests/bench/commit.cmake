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
file(CONFIGURE OUTPUT "${HEADER}" CONTENT "#define BENCH_COMMIT \"${commit}\"\n")
