# Toolchain: 64-bit Windows, built on another machine by Debian's MinGW-w64 with POSIX threads
# (g++-mingw-w64-x86-64-posix) and run by Wine (wine64). The preset mingw uses it.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
# Debian's package wine64 has its program in a folder that is not searched.
find_program(ODE_PARALLEL_SAP_WINE NAMES wine64 wine HINTS /usr/lib/wine)
mark_as_advanced(ODE_PARALLEL_SAP_WINE)
if(ODE_PARALLEL_SAP_WINE)
  set(CMAKE_CROSSCOMPILING_EMULATOR env WINEDEBUG=-all "${ODE_PARALLEL_SAP_WINE}")
endif()
# Programs contain the compiler's libraries, so that Windows finds all that they need.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libgomp.a OUTPUT_VARIABLE ode_parallel_sap_libgomp
                OUTPUT_STRIP_TRAILING_WHITESPACE)
set(OpenMP_gomp_LIBRARY "${ode_parallel_sap_libgomp}" CACHE FILEPATH "GCC's OpenMP runtime, static")

# The build machine's own ODE is of no use here.
set(ENV{PKG_CONFIG_LIBDIR} /usr/x86_64-w64-mingw32/lib/pkgconfig)
