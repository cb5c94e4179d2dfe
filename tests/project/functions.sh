#!/usr/bin/env bash
# functions.sh SOURCE
#
# No function has more than 60 lines or takes more than 6 parameters, kernels included. With Universal Ctags, which
# tells where functions begin and end; skipped (77) where it is missing.
set -euo pipefail
most_lines=60 most_parameters=6
here=$(cd "$(dirname "$0")" && pwd)
ctags --version 2>/dev/null | grep -q '^Universal Ctags' || { echo "Skipped: needs universal-ctags" && exit 77; }

# Lines "lines parameters file:line name", of each function under a folder.
functions() {
  (cd "$1" && find space cuda examples -type f \( -name '*.h' -o -name '*.c' -o -name '*.cpp' -o -name '*.cu' \
    -o -name '*.cuh' \) -not -path 'space/cmake/*' | LC_ALL=C sort |
    ctags -L - -f - --languages=C,C++ --map-C++=+.h --map-C++=+.cuh --map-C++=+.cu --kinds-C++=f --kinds-C=f \
      --fields=+neS -I '__launch_bounds__+,__global__,__device__,ODE_PARALLEL_SAP_BOTH_SIDES' 2>/dev/null) |
    awk -F'\t' -f "$here/functions.awk"
}
long() { # long FOLDER: prints what is too long, and fails if there is any
  functions "$1" | awk -v lines=$most_lines -v parameters=$most_parameters '
    $1 > lines { print $3 ": " $4 " has " $1 " lines"; bad = 1 }
    $2 > parameters { print $3 ": " $4 " has " $2 " parameters"; bad = 1 }
    END { exit bad }'
}

# First what cannot be missed, so that a change of ctags is not taken for short functions.
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/space" "$folder/cuda" "$folder/examples"
{
  echo '__global__ void __launch_bounds__(threads) longKernel(int a) {'
  for i in {1..59}; do echo '  a += 1;'; done
  echo '}'
} >"$folder/cuda/a.cu"
cat >"$folder/space/a.cpp" <<'END'
template <class A, class B>
std::pair<A, B> Some<A>::seven(int a, std::map<int, int> b, void (*c)(int, int), A d = A{1, 2},
                               int e = f(1, 2), const B& g, int h) const {
  return {};
}
void six(int a, std::map<int, int> b, void (*c)(int, int), int d, int e, int f) {}
END
expected='cuda/a.cu:1: longKernel has 61 lines
space/a.cpp:2: seven has 7 parameters'
diff <(echo "$expected") <(long "$folder" || true) || { echo "ctags is not understood" && exit 1; }

long "$1" || exit 1
functions "$1" | awk '{ if ($1 > lines) { lines = $1; name = $4 } }
  END { print NR " functions, the longest, " name ", of " lines " lines"; exit NR < 1000 }'
