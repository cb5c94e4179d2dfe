#!/usr/bin/env bash
# build_and_run.sh SOURCE BUILD [OPTION]...
#
# The preset aarch64 with these options in a directory of its own: an example and the tests of pairs, their order and
# what is kept, the parts behind the interface included, on 64-bit ARM, and the count of what NEON saves. An emulator tells
# nothing of threads that it would not tell of one, and takes some fifty times as long as a processor: one thread, and a
# tenth of the random work.
set -euo pipefail
source=$1 build=$2 jobs=$(nproc)
shift 2

without() {
  echo "SKIPPED: there is no $1 (Debian: $2)"
  exit 77
}
compiler=aarch64-linux-gnu-g++
command -v "$compiler" >/dev/null || without "$compiler" g++-aarch64-linux-gnu
command -v qemu-aarch64 >/dev/null || without qemu-aarch64 qemu-user
# Version 2 of Catch2 is a header; version 3 has a library, too, which is this machine's as a rule.
echo '#include <catch2/catch.hpp>' | "$compiler" -E -x c++ - >/dev/null 2>&1 ||
  echo 'int main() {}' | "$compiler" -x c++ - -lCatch2 -o /dev/null 2>/dev/null ||
  without "Catch2 for aarch64" "catch2, or from version 3 on libcatch2-dev of arm64"

cmake -S "$source" -B "$build" --preset aarch64 "-DODE_PARALLEL_SAP_PROPERTY_TESTS=pairs;motions" "$@"
cmake --build "$build" --parallel "$jobs" --target minimal core-tests c-library-modes property-tests sweep-count
export OMP_THREAD_LIMIT=1 ODE_PARALLEL_SAP_TEST_SCALE=0.1
exec ctest --test-dir "$build" --parallel "$jobs" --output-on-failure --no-tests=error --timeout 900 \
  -R '^(examples\.minimal|core|core\.c-library-modes|install\.arithmetic|instructions|pairs|motions)$'
