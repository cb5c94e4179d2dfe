# Rivals that no package brings: each is compiled here from a source directory that the user names
# (README.md says which version and how to get it), and is left out where that is empty.
set(ODE_PARALLEL_SAP_BENCH_PHYSX "" CACHE PATH "PhysX 5, the directory that has source/ and include/")
set(ODE_PARALLEL_SAP_BENCH_JOLT "" CACHE PATH "Jolt Physics, the directory that has Jolt/ and Build/")

# Other people's code: their warnings are nothing to us.
function(add_foreign_library name)
  add_library(${name} STATIC EXCLUDE_FROM_ALL ${ARGN})
  target_compile_options(${name} PRIVATE -w)
  set_target_properties(${name} PROPERTIES EXPORT_COMPILE_COMMANDS OFF)
endfunction()

# The broad phases of PhysX's CPU side, what they stand on, and its pool of threads. Its own build
# would fetch its tools from the network first.
function(add_physx root)
  set(from ${root}/source)
  file(GLOB sources ${from}/lowlevelaabb/src/*.cpp ${from}/foundation/*.cpp ${from}/foundation/unix/*.cpp)
  add_foreign_library(
    bench-physx
    ${sources}
    ${from}/common/src/CmRadixSort.cpp
    ${from}/task/src/TaskManager.cpp
    ${from}/physxextensions/src/ExtCpuWorkerThread.cpp
    ${from}/physxextensions/src/ExtDefaultCpuDispatcher.cpp)
  target_include_directories(
    bench-physx SYSTEM PUBLIC ${root}/include ${from}/lowlevelaabb/include ${from}/lowlevel/common/include/utils
                              ${from}/lowlevel/api/include)
  target_include_directories(
    bench-physx PRIVATE ${from}/common/include ${from}/common/src ${from}/geomutils/include ${from}/geomutils/src
                        ${from}/foundation ${from}/lowlevelaabb/src ${from}/lowlevel/common/include/pipeline)
  target_compile_definitions(bench-physx PUBLIC PX_PHYSX_STATIC_LIB DISABLE_CUDA_PHYSX)
  find_package(Threads REQUIRED)
  target_link_libraries(bench-physx PUBLIC Threads::Threads ${CMAKE_DL_LIBS})
endfunction()

# By its own build, as its users get it (AVX2 among other things), without its tools for developers.
function(add_jolt root)
  foreach(option DEBUG_RENDERER_IN_DEBUG_AND_RELEASE PROFILER_IN_DEBUG_AND_RELEASE ENABLE_OBJECT_STREAM
                 FLOATING_POINT_EXCEPTIONS_ENABLED GENERATE_DEBUG_SYMBOLS ENABLE_INSTALL ENABLE_ALL_WARNINGS
                 INTERPROCEDURAL_OPTIMIZATION JPH_USE_VK JPH_USE_DX12 JPH_USE_CPU_COMPUTE
                 BUILD_SHARED_LIBS)
    set(${option} OFF)
  endforeach()
  # A collector of pairs is derived from a class of its.
  set(CPP_RTTI_ENABLED ON)
  set(CPP_EXCEPTIONS_ENABLED ON)
  add_subdirectory(${root}/Build ${CMAKE_CURRENT_BINARY_DIR}/jolt EXCLUDE_FROM_ALL)
endfunction()

# add_source_peer(<name> <directory> <a file of it>): sets <name>_FOUND, false where no directory is named; where another was that is
# an error.
macro(add_source_peer name directory file)
  set(${name}_FOUND FALSE)
  if(EXISTS "${directory}/${file}")
    set(${name}_FOUND TRUE)
    cmake_language(CALL add_${name} "${directory}")
  elseif(NOT "${directory}" STREQUAL "")
    message(FATAL_ERROR "${directory} has no ${file}: see tests/bench/README.md.")
  endif()
endmacro()
add_source_peer(physx "${ODE_PARALLEL_SAP_BENCH_PHYSX}" source/lowlevelaabb/include/BpBroadPhase.h)
add_source_peer(jolt "${ODE_PARALLEL_SAP_BENCH_JOLT}" Build/CMakeLists.txt)
