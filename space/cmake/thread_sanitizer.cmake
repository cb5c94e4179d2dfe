# ThreadSanitizer does not see how OpenMP's threads wait for each other unless the runtime tells it.
# LLVM's does so through Archer, which it loads by name: in a build under this sanitizer all programs
# get Archer's directory into their search path.
if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize=[a-z,]*thread")
  return()
endif()

get_filename_component(openmp_dir "${OpenMP_omp_LIBRARY}" DIRECTORY)
find_library(archer NAMES archer PATHS "${openmp_dir}" NO_DEFAULT_PATH NO_CACHE)
if(archer)
  message(STATUS "ThreadSanitizer with Archer: ${archer}")
  list(APPEND CMAKE_BUILD_RPATH "${openmp_dir}")
else()
  message(WARNING "ThreadSanitizer will report races that are none: the OpenMP runtime of ${CMAKE_CXX_COMPILER_ID} does "
                  "not come with Archer (libarcher.so). Debian's packages clang and libomp-dev have it.")
endif()
