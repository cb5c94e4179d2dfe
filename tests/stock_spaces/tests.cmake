# What ODE's own spaces miss and invent: see space/preload/STOCK_SPACES.md.
add_executable(stock-spaces "${CMAKE_CURRENT_LIST_DIR}/campaign.cpp")
target_link_libraries(stock-spaces PRIVATE test-support)
enable_warnings(stock-spaces)
add_test(NAME stock-spaces COMMAND stock-spaces 100)
# A space that aborted stays locked and cannot be destroyed.
set_tests_properties(stock-spaces PROPERTIES LABELS cpu SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT "ASAN_OPTIONS=detect_leaks=0")
