# The CUDA back end on devices that are emulated: needs CUDA's headers, no device. Its kernels are compiled as C++, so none of this
# is linked with CUDA's runtime.
get_target_property(sources ode-parallel-sap-cuda-objects SOURCES)
list(TRANSFORM sources PREPEND "${PROJECT_SOURCE_DIR}/cuda/")
set(kernels ${sources})
list(FILTER kernels INCLUDE REGEX "\\.cu$")
set_source_files_properties(
  ${kernels} PROPERTIES LANGUAGE CXX COMPILE_OPTIONS "-x;c++;-include;${CMAKE_CURRENT_LIST_DIR}/kernel_language.h")
add_library(emulated-cuda OBJECT ${sources})
# nvcc looks at kernels for warnings; names beginning with two underscores are its language.
target_compile_options(emulated-cuda PRIVATE -w -ffp-contract=off)
add_executable(
  emulation-tests
  "${CMAKE_CURRENT_LIST_DIR}/block.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/emulation_test.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/runtime.cpp"
  gpu/device_subset_test.cpp
  support/case.cpp
  "${PROJECT_SOURCE_DIR}/cuda/check/scenes.cpp"
  $<TARGET_OBJECTS:emulated-cuda>
  $<TARGET_OBJECTS:ode-parallel-sap>
  $<TARGET_OBJECTS:ode-parallel-sap-core>)
foreach(target emulated-cuda emulation-tests)
  # Ours come ahead of CUDA's and the project's of the same name.
  target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_LIST_DIR}/include" "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  target_include_directories(${target} SYSTEM PRIVATE ${CUDAToolkit_INCLUDE_DIRS})
  target_link_libraries(${target} PRIVATE OpenMP::OpenMP_CXX)
endforeach()
set_property(TARGET emulation-tests PROPERTY CUDA_ARCHITECTURES OFF)
target_link_libraries(emulation-tests PRIVATE test-support)
enable_warnings(emulation-tests)

# Devices are free (-), full (f), of another generation (o) or too old (x).
set(machines)
foreach(machine full-free=f- auto-full-free=f- free-full-free=-f- full-full=ff auto-full=f free-free=-- free-free-free=---
                free-other-free=-o- no-links=-- locks-of-two=-- read-ahead=-- locks=- kernels-on-host=- forked-locks=- no-thread=-- freed=fff
                full-in-frame=- forked=- reset=-- first-use=- no-driver=no-driver no-device= old-device=x)
  string(REPLACE "=" " ODE_PARALLEL_SAP_TEST_MACHINE=" machine ${machine})
  list(APPEND machines "${machine}")
endforeach()
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=thread")
  message(STATUS "Tests of kernels on emulated devices: not with ThreadSanitizer, which takes their threads' stacks for one")
  list(FILTER machines EXCLUDE REGEX "^free-free-free")
else()
  add_test(NAME emulation COMMAND emulation-tests "[emulation]")
  set_tests_properties(emulation PROPERTIES LABELS cpu ENVIRONMENT ODE_PARALLEL_SAP_TEST_MACHINE=------------------ TIMEOUT 3600)
endif()
add_environments_test(device.subsets cpu emulation-tests "--warn;${warn_of_no_tests};[@name@]" ${machines})
