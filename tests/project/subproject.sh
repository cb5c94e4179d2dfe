#!/usr/bin/env bash
# subproject.sh SOURCE BUILD CMAKE_OPTION...
#
# Builds the library as a part of the project in parent/: settings and tests of the parent's are its
# own, whatever they are, and a unity build of all of it works. Where the parent says nothing of optimising, the
# library is optimised, and the parent is not. The objects in BUILD are kept.
. "$(dirname "$0")/../support/script.sh"
source=$1 build=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$build"

# configure OPTION...: anew, as a parent with these settings.
configure() {
  rm -f "$build/CMakeCache.txt"
  cmake -S "$here/parent" -B "$build" -DPART="$source" "$@" >"$folder/said" 2>&1 || fail "not configured: $*"
  quietly ctest --test-dir "$build" -N
  grep -q 'Total Tests: 1$' "$folder/said" || fail "the part adds tests to its parent"
}

# expect_optimised FILE FLAG: the last -O with which a file is compiled; FLAG may be empty.
expect_optimised() {
  local found
  found=$(grep "\"command\".* -c [^ ]*$1\"" "$build/compile_commands.json" | grep -o -e ' -O[^ ]*' | tail -n 1 || true)
  [ "${found# }" = "$2" ] || fail "$1 is compiled with '${found# }', not with '$2'"
}

unset CFLAGS CXXFLAGS
configure "$@" -DBUILD_SHARED_LIBS=ON -DBUILD_TESTING=ON -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
expect_optimised space/api/api.cpp -O2
expect_optimised space/pairs/row_table.cpp -O2
expect_optimised tests/install/user.c ''
configure "$@" -DCMAKE_CXX_FLAGS=-O1 -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
expect_optimised space/api/api.cpp -O1
configure "$@" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
expect_optimised space/api/api.cpp ''
configure "$@" -DCMAKE_UNITY_BUILD=ON
quietly cmake --build "$build"
ctest --test-dir "$build" --output-on-failure
[ -e "$build/part/space/libode-parallel-sap.a" ] || fail "not the static library that add_library means by itself"
