#!/usr/bin/env bash
# use.sh BUILD|PREFIX find_package|pkg-config|preload [PROGRAM]
#
# Installs a build to a new prefix, whose path has a space in it, or takes the prefix of a copy that is installed, and
# uses it from there: builds and runs user.c against it, or runs PROGRAM, spaces_program.cpp if none is named, under the
# installed preload library. CC and CXX are taken from the environment.
. "$(dirname "$0")/../support/script.sh"
build=$1 way=$2 here=$(cd "$(dirname "$0")" && pwd)
prefix=$build
if [ -e "$build/CMakeCache.txt" ]; then
  prefix="$folder/a prefix"
  cmake --install "$build" --prefix "$prefix" >/dev/null
fi
pkgconfig=$(find "$prefix" -name ode-parallel-sap.pc -print -quit)
[ "$pkgconfig" ] || fail "nothing is installed in $prefix"
libdir=$(dirname "$(dirname "$pkgconfig")")
export PKG_CONFIG_PATH="$libdir/pkgconfig:${PKG_CONFIG_PATH-}"

# A static library keeps the plug-in that it is linked into in memory, as a shared one does itself.
check_stays() {
  [ -e "$libdir/libode-parallel-sap.so" ] || readelf -d "$1" | grep -q NODELETE ||
    fail "a plug-in with the library in it could be unloaded under the threads"
}

# Nothing that the library uses within may be on the command line that compiles a user's file.
check_compile_line() {
  ! grep -Ei -e '-fopenmp|cuda|ode/src|ode-private|-std=' <<<"$1" ||
    fail "the compile line of a user has more than the public headers need"
}

case $way in
  find_package)
    cmake -S "$here" -B "$folder/user" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >/dev/null
    check_compile_line "$(grep '"command"' "$folder/user/compile_commands.json")"
    quietly cmake --build "$folder/user"
    "$folder/user/user"
    check_stays "$folder/user/plug-in.so"
    ;;
  pkg-config)
    check_compile_line "$(pkg-config --cflags ode-parallel-sap)"
    eval "flags=($(pkg-config --cflags --libs ode-parallel-sap))"
    for compiler in gcc "${CC:-cc}"; do # a user need not have the compiler of the library
      "$compiler" "$here/user.c" -o "$folder/user-program" "${flags[@]}"
      LD_LIBRARY_PATH="$libdir:${LD_LIBRARY_PATH-}" "$folder/user-program"
    done
    # A program compiled for the other precision is told so in its first call.
    refused=0
    for precision in dIDESINGLE dIDEDOUBLE; do
      "${CC:-cc}" "$here/user.c" -o "$folder/user-program" "${flags[@]}" -UdIDESINGLE -UdIDEDOUBLE -D$precision
      LD_LIBRARY_PATH="$libdir:${LD_LIBRARY_PATH-}" "$folder/user-program" >"$folder/log" 2>&1 ||
        refused=$((refused + $(grep -c 'compiled for .* precision, .* in dParallelSAPSpaceCreate()' "$folder/log")))
    done
    [ $refused -eq 1 ] || fail "not one precision of two is refused"
    "${CC:-cc}" -shared -fPIC "$here/user.c" -o "$folder/plug-in.so" "${flags[@]}"
    check_stays "$folder/plug-in.so"
    ;;
  preload)
    program=${3-$folder/spaces-program}
    if [ $# -lt 3 ]; then
      eval "flags=($(pkg-config --cflags --libs ode))"
      "${CXX:-c++}" "$here/../preload/spaces_program.cpp" -o "$program" "${flags[@]}"
    fi
    said=$(LD_LIBRARY_PATH=$libdir LD_PRELOAD=libode-parallel-sap-preload.so ODE_PARALLEL_SAP_STATS=1 "$program" 2>&1)
    grep -q '^ode-parallel-sap: 1 quadtree spaces replaced' <<<"$said"
    ;;
esac
