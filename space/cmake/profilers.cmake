# Stages of a frame as ranges of NVTX and tasks of ITT, where their headers are. NVTX's are the CUDA toolkit's, and all
# there is to it. ITT's go with a static library (github.com/intel/ittapi), which a static library of ours could not
# bring along.
option(ODE_PARALLEL_SAP_PROFILERS "Show stages to profilers that use NVTX or ITT, where their headers are" ON)
if(ODE_PARALLEL_SAP_PROFILERS)
  find_path(ODE_PARALLEL_SAP_NVTX_DIR nvtx3/nvToolsExt.h HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES include)
  mark_as_advanced(ODE_PARALLEL_SAP_NVTX_DIR)
  if(ODE_PARALLEL_SAP_NVTX_DIR)
    set_property(
      SOURCE frame/stage_ranges.cpp
      APPEND
      PROPERTY COMPILE_OPTIONS "-isystem${ODE_PARALLEL_SAP_NVTX_DIR}")
    target_compile_definitions(ode-parallel-sap PRIVATE ODE_PARALLEL_SAP_NVTX)
    message(STATUS "Stages as ranges of NVTX: ${ODE_PARALLEL_SAP_NVTX_DIR}")
  endif()
  find_path(ODE_PARALLEL_SAP_ITT_DIR ittnotify.h)
  find_library(ODE_PARALLEL_SAP_ITT_LIBRARY ittnotify)
  mark_as_advanced(ODE_PARALLEL_SAP_ITT_DIR ODE_PARALLEL_SAP_ITT_LIBRARY)
  if(BUILD_SHARED_LIBS AND ODE_PARALLEL_SAP_ITT_DIR AND ODE_PARALLEL_SAP_ITT_LIBRARY)
    set_property(
      SOURCE frame/stage_ranges.cpp
      APPEND
      PROPERTY COMPILE_OPTIONS "-isystem${ODE_PARALLEL_SAP_ITT_DIR}")
    target_compile_definitions(ode-parallel-sap PRIVATE ODE_PARALLEL_SAP_ITT)
    target_link_libraries(ode-parallel-sap PRIVATE ${ODE_PARALLEL_SAP_ITT_LIBRARY})
    message(STATUS "Stages as tasks of ITT: ${ODE_PARALLEL_SAP_ITT_LIBRARY}")
  endif()
endif()
