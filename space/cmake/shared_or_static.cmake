# A program must have one ODE. A shared ode-parallel-sap would hold a static ODE of its own, beside its program's, so with a static
# ODE it is static, too; and on Windows, as ODE's DLL exports no class.
set(only_static "")
if(WIN32)
  set(only_static "on Windows, as ODE's DLL exports no class")
elseif(ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES MATCHES "(^|[/;])(lib[^/;]*ode[^/;]*[.]a)(;|$)")
  set(only_static "with the static ODE ${ODE_PARALLEL_SAP_LIBODE_LINK_LIBRARIES}, of which a shared one would hold a copy beside "
                  "the program's")
  list(JOIN only_static "" only_static)
endif()
if(PROJECT_IS_TOP_LEVEL AND NOT DEFINED BUILD_SHARED_LIBS)
  set(shared_by_default ON)
  if(only_static)
    set(shared_by_default OFF)
    message(STATUS "ode-parallel-sap is a static library, without the preload library, ${only_static}")
  endif()
  option(BUILD_SHARED_LIBS "Build a shared library" ${shared_by_default})
endif()
if(only_static AND BUILD_SHARED_LIBS)
  message(FATAL_ERROR "ode-parallel-sap is a static library ${only_static}. Remedies: configure with -DBUILD_SHARED_LIBS=OFF; or "
                      "with a shared ODE (in vcpkg: a dynamic triplet; or -DODE_PARALLEL_SAP_ODE=SOURCE builds one).")
endif()
