# What ODE's own spaces miss and invent: see space/preload/STOCK_SPACES.md.
add_executable(stock-spaces "${CMAKE_CURRENT_LIST_DIR}/campaign.cpp")
target_link_libraries(stock-spaces PRIVATE test-support)
enable_warnings(stock-spaces)
add_test(NAME stock-spaces COMMAND stock-spaces 100)
# A space that aborted stays locked and cannot be destroyed.
set_tests_properties(stock-spaces PROPERTIES LABELS cpu SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT "ASAN_OPTIONS=detect_leaks=0")

if(COMMAND add_preload_test)
  add_executable(smallest-programs "${CMAKE_CURRENT_LIST_DIR}/smallest.c")
  target_link_libraries(smallest-programs PRIVATE PkgConfig::ODE_PARALLEL_SAP_LIBODE)
  enable_warnings(smallest-programs)
  add_script_test(smallest smallest $<TARGET_FILE:smallest-programs>)
endif()
