# The kernels on devices that are emulated: needs CUDA's headers, no device. As no kernel is started there, none of this is
# linked with CUDA's runtime; nor with the library, which as a static one would bring CUDA's functions a second time.
if(NOT TARGET ode-parallel-sap-cuda-objects)
  return()
endif()
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=thread")
  message(STATUS "Test on emulated devices: not with ThreadSanitizer, which takes their threads' stacks for one")
  return()
endif()
set(kernels)
foreach(name cells classify clusters lists own_lists search)
  list(APPEND kernels "${PROJECT_SOURCE_DIR}/cuda/one/${name}.cu")
endforeach()
set_source_files_properties(${kernels} PROPERTIES LANGUAGE CXX COMPILE_OPTIONS "-x;c++")
add_library(emulated-kernels OBJECT ${kernels})
# nvcc looks at them for warnings; names beginning with two underscores are its language.
target_compile_options(emulated-kernels PRIVATE -w -ffp-contract=off -include
                                                "${CMAKE_CURRENT_LIST_DIR}/kernel_language.h")
add_executable(
  emulation-tests
  "${CMAKE_CURRENT_LIST_DIR}/block.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/emulation_test.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/runtime.cpp"
  support/knobs.cpp
  "${PROJECT_SOURCE_DIR}/cuda/check/scenes.cpp"
  "${PROJECT_SOURCE_DIR}/cuda/one/device_sweep.cpp"
  "${PROJECT_SOURCE_DIR}/cuda/several/device_group.cpp"
  $<TARGET_OBJECTS:emulated-kernels>
  $<TARGET_OBJECTS:ode-parallel-sap-core>)
foreach(target emulated-kernels emulation-tests)
  # Ours come ahead of CUDA's and the project's of the same name.
  target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_LIST_DIR}/include" "${PROJECT_SOURCE_DIR}"
                                               "${CMAKE_CURRENT_SOURCE_DIR}")
  target_include_directories(${target} SYSTEM PRIVATE ${CUDAToolkit_INCLUDE_DIRS})
  target_link_libraries(${target} PRIVATE OpenMP::OpenMP_CXX)
endforeach()
target_link_libraries(emulation-tests PRIVATE Catch2::Catch2 Threads::Threads)
enable_warnings(emulation-tests)
add_test(NAME emulation COMMAND emulation-tests)
set_tests_properties(emulation PROPERTIES LABELS cpu TIMEOUT 3600)
