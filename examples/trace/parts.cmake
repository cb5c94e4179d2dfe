# What reads traces and makes their geoms again: for the program here, the study, the benchmarks and the tests.
if(TARGET trace-parts)
  return()
endif()
add_library(
  trace-parts STATIC
  "${CMAKE_CURRENT_LIST_DIR}/player.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/replayed_shapes.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/trace_reader.cpp")
target_compile_features(trace-parts PUBLIC cxx_std_17)
target_include_directories(trace-parts PUBLIC "${CMAKE_CURRENT_LIST_DIR}" "${PROJECT_SOURCE_DIR}")
target_link_libraries(trace-parts PUBLIC ode-parallel-sap::ode-parallel-sap)
enable_warnings(trace-parts)
