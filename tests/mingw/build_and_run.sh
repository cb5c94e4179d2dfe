#!/usr/bin/env bash
# build_and_run.sh SOURCE BUILD [OPTION]...
#
# The preset mingw with these options in a directory of its own: the library, three examples and tests for 64-bit Windows,
# run by Wine, with a tenth of the random work.
set -euo pipefail
source=$1 build=$2 jobs=$(nproc) files='pairs edits narrow queries lifecycle'
shift 2

without() {
  echo "SKIPPED: there is no $1 (Debian: $2)"
  exit 77
}
command -v x86_64-w64-mingw32-g++-posix >/dev/null || without x86_64-w64-mingw32-g++-posix g++-mingw-w64-x86-64-posix
PATH=$PATH:/usr/lib/wine command -v wine64 >/dev/null || without wine64 wine64
[ -e /usr/include/catch2/catch.hpp ] || without "version 2 of Catch2, which is a header alone" catch2

cmake -S "$source" -B "$build" --preset mingw "-DODE_PARALLEL_SAP_PROPERTY_TESTS=${files// /;}" "$@"
cmake --build "$build" --parallel "$jobs" --target minimal triggers pile core-tests property-tests
# The first program starts Wine's services, which would keep its output open for as long as other tests run.
PATH=$PATH:/usr/lib/wine WINEDEBUG=-all wine64 "$build/examples/minimal/minimal.exe" </dev/null >/dev/null 2>&1 || true
export OMP_WAIT_POLICY=passive ODE_PARALLEL_SAP_TEST_SCALE=0.1
exec ctest --test-dir "$build" --parallel "$jobs" --output-on-failure --no-tests=error --timeout 900 \
  -R "^(examples\..*|core|pairs\.simd|${files// /|})$"
