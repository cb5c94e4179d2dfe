# cmake -DPROGRAM=... -DOPTIONS=... -DFIRST=... -DSECOND=... -DFOLDER=... -P compare_runs.cmake
# Runs the program with FIRST and with SECOND added to the options. Everything in the two CSV files
# but the times must be the same, digit for digit.
file(MAKE_DIRECTORY "${FOLDER}")
foreach(run FIRST SECOND)
  set(file "${FOLDER}/compare_runs_${run}.csv")
  execute_process(COMMAND ${PROGRAM} ${OPTIONS} ${${run}} --csv "${file}" RESULT_VARIABLE result)
  if(NOT result STREQUAL "0")
    message(FATAL_ERROR "the run with '${${run}}' ends with '${result}'")
  endif()
  file(STRINGS "${file}" rows)
  list(POP_FRONT rows header)
  if(NOT header MATCHES
     "^frame,time_s,geoms,pairs,contacts,asleep,[a-z_,]*step_ms,deepest_m,fastest_m_s,energy$")
    message(FATAL_ERROR "the columns are not those this script knows: ${header}")
  endif()
  # Six columns that are the same in every run, ten times, three columns that are the same.
  list(TRANSFORM rows REPLACE "^([^,]*,[^,]*,[^,]*,[^,]*,[^,]*,[^,]*),.*,([^,]*,[^,]*,[^,]*)$" "\\1,\\2")
  set(rows_${run} "${rows}")
endforeach()
list(LENGTH rows_FIRST count)
if(count LESS 10)
  message(FATAL_ERROR "only ${count} rows")
endif()
foreach(first second IN ZIP_LISTS rows_FIRST rows_SECOND)
  if(NOT first STREQUAL second)
    message(FATAL_ERROR "the runs differ:\n${first}\n${second}")
  endif()
endforeach()
