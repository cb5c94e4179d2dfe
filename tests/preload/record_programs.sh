#!/usr/bin/env bash
# record_programs.sh BUILD RESULTS
#
# What the preload library does for programs that are not ours: runs those that are installed, and
# writes RESULTS/programs.csv. Needs a build with its tests; python3-pyode, libdart-collision-ode-dev
# and libeigen3-dev as far as they are there.
set -euo pipefail
build=$(realpath "$1") results=$(realpath "$2")
cd "$(dirname "$0")"
preload=$build/space/preload/libode-parallel-sap-preload.so
recorder=$build/tests/preload/libpair-recorder.so
demos=$build/tests/preload
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1 | sed 's/ *\([0-9]*-Core\)\? *Processor$//'),$(nproc),,"
machine+=",$(c++ --version | sed -n '1s/.* /GNU /p'),-O3 -DNDEBUG,$(git describe --always --dirty --abbrev=10),$(date -u +%F)"
csv=$results/programs.csv
echo "program,replaced,geoms,calls,same,pairs,unowed,missed,stock_ms,replaced_ms,cpu,cores,gpu,driver,compiler,flags,commit,date" >"$csv"
export DRAWSTUFF_FRAMES=400 DRAWSTUFF_KEYS=bscxyvbsc REPEATS=${REPEATS:-3}

record() {
  local line
  line=$(./compare_spaces.sh "$recorder" "$preload" "$@") || { echo "$line" >&2; exit 1; }
  echo "$line,$machine" | tee -a "$csv"
}

for demo in boxstack buggy crash friction heightfield motion space; do
  record "ODE demo_$demo" "$demos/demo_$demo"
done
ODE_PARALLEL_SAP_REPLACE=hash,simple record "ODE demo_buggy and simple" "$demos/demo_buggy"
if /usr/bin/python3 -c 'import ode' 2>/dev/null; then
  for space in hash sap quadtree nested; do
    record "PyODE $space" /usr/bin/python3 pyode_pile.py $space 1000 60
  done
  ODE_PARALLEL_SAP_REPLACE=simple record "PyODE simple" /usr/bin/python3 pyode_pile.py simple 1000 60
  ODE_PARALLEL_SAP_REPLACE=hash,simple record "PyODE nested and simple" /usr/bin/python3 pyode_pile.py nested 1000 60
fi
if c++ -O2 -std=c++17 dart_pile.cpp -I/usr/include/eigen3 -ldart-collision-ode -ldart -o "$folder/dart_pile" 2>"$folder/why"; then
  record "DART" "$folder/dart_pile" 1000 50
else
  echo "left out: DART (libdart-collision-ode-dev, libeigen3-dev)" >&2
fi
