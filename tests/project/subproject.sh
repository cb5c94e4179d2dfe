#!/usr/bin/env bash
# subproject.sh SOURCE BUILD CMAKE_OPTION...
#
# Builds the library as a part of the project in parent/: settings and tests of the parent's are its
# own, whatever they are, and a unity build of all of it works. The objects in BUILD are kept.
set -euo pipefail
source=$1 build=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$build"
fail() {
  echo "$*"
  exit 1
}

# configure OPTION...: anew, as a parent with these settings.
configure() {
  rm -f "$build/CMakeCache.txt"
  cmake -S "$here/parent" -B "$build" -DPART="$source" "$@" >"$build.log" 2>&1 || { cat "$build.log"; exit 1; }
  ctest --test-dir "$build" -N >"$build.log"
  grep -q 'Total Tests: 1$' "$build.log" || fail "the part adds tests to its parent: $(tail -1 "$build.log")"
}

configure "$@" -DBUILD_SHARED_LIBS=ON -DBUILD_TESTING=ON
configure "$@" -DCMAKE_UNITY_BUILD=ON
cmake --build "$build" >"$build.log" 2>&1 || { tail -30 "$build.log"; exit 1; }
ctest --test-dir "$build" --output-on-failure
[ -e "$build/part/space/libode-parallel-sap.a" ] || fail "not the static library that add_library means by itself"
