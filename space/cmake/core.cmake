# Products and sums are rounded one by one. Where a processor can fuse them compilers do so, on ARM everywhere, on x86
# in the kernels of one instruction set and not in another's; but all are to come to the same numbers, and the bounds on
# errors of rounding are those of single operations.
set(round_one_by_one "$<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-ffp-contract=off>")

# What finds pairs in plain arrays, without a word of ODE. Tests reach into it; users see the library. The
# check program of cuda/ is built from it alone.
set(core "${CMAKE_CURRENT_LIST_DIR}/..")
add_library(
  ode-parallel-sap-core OBJECT
  ${core}/cache/fat_proxies.cpp
  ${core}/cache/changed_pairs.cpp
  ${core}/base/pair_list.cpp
  ${core}/base/platform.cpp
  ${core}/pairs/cell_order.cpp
  ${core}/pairs/cell_trees.cpp
  ${core}/paper/axis_lists.cpp
  ${core}/paper/brute_force.cpp
  ${core}/pairs/sweep.cpp
  ${core}/base/parallel.cpp
  ${core}/simd/kernels.cpp
  ${core}/simd/kernels_portable.cpp
  ${core}/pairs/row_table.cpp)

# Kernels for each instruction set are built whatever the build machine has, and chosen at run time.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  target_sources(
    ode-parallel-sap-core PRIVATE ${core}/simd/kernels_sse2.cpp ${core}/simd/kernels_avx2.cpp
                                  ${core}/simd/kernels_avx512.cpp)
  set_property(SOURCE ${core}/simd/kernels_avx2.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx2)
  set_property(SOURCE ${core}/simd/kernels_avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx512f -mavx512dq -mavx512vl)
  # Else what is changed in one kernel makes others slower or faster, as their loops come to lie: boxes met by brute force
  # by a tenth.
  set_property(
    SOURCE ${core}/simd/kernels_sse2.cpp ${core}/simd/kernels_avx2.cpp ${core}/simd/kernels_avx512.cpp
    APPEND
    PROPERTY COMPILE_OPTIONS "$<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang>:-falign-loops=32>")
  if(MINGW AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # On Windows GCC aligns the stack to 16 bytes, and yet takes vectors on it for aligned.
    set_property(SOURCE ${core}/simd/kernels_avx2.cpp ${core}/simd/kernels_avx512.cpp APPEND
                 PROPERTY COMPILE_OPTIONS -Wa,-muse-unaligned-vector-move)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC 12 warns of the undefined registers in its own intrinsics.
    set_property(SOURCE ${core}/simd/kernels_avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -Wno-maybe-uninitialized)
  endif()
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64|ARM64)$")
  target_sources(ode-parallel-sap-core PRIVATE ${core}/simd/kernels_neon.cpp)
endif()

target_include_directories(ode-parallel-sap-core PUBLIC "${core}/..")
target_compile_options(ode-parallel-sap-core PRIVATE ${round_one_by_one})
target_link_libraries(ode-parallel-sap-core PUBLIC OpenMP::OpenMP_CXX)
