#!/usr/bin/env bash
# record_traces.sh BUILD RESULTS
#
# What each option would give programs that are not ours: traces those that are installed, looks whether the traces have
# the programs' pairs, and writes RESULTS/traces.csv by trace-replay and, where the build has the benchmarks,
# RESULTS/trace_peers.csv by pair-benchmark. Needs a build with tests and examples; python3-pyode and
# libdart-collision-ode-dev as far as they are there. TURNS (5): how often a trace is played for a row.
[ $# -eq 2 ] || { echo "usage: record_traces.sh BUILD RESULTS" >&2; exit 2; }
. "$(dirname "$0")/with_preload.sh"
build=$(realpath "$1") results=$(realpath "$2")
cd "$(dirname "$0")"
preload=$build/space/preload/libode-parallel-sap-preload.so
replay=$build/examples/trace/trace-replay
benchmark=$build/tests/bench/pair-benchmark
export DRAWSTUFF_FRAMES=400 DRAWSTUFF_KEYS=bscxyvbsc

peer_names=parallel-sap,parallel-sap:begun-ended,dHashSpace,dSweepAndPruneSpace,embree,embree-default,bullet-dbvt,fcl-tree
machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1 | sed 's/ *\([0-9]*-Core\)\? *Processor$//'),$(nproc),,"
machine+=",$(c++ --version | sed -n '1s/.* /GNU /p'),-O3 -DNDEBUG,$(git describe --always --dirty --abbrev=10),$(date -u +%F)"
csv=$results/traces.csv peers=$results/trace_peers.csv
rm -f "$peers"
echo "program,frames,geoms,option,threads,collides,median_ms,least_ms,pairs,contacts,cpu,cores,gpu,driver,compiler,flags,commit,date" >"$csv"

# record PROGRAM COMMAND...
record() {
  local program=$1 trace=$folder/trace frames geoms
  shift
  ODE_PARALLEL_SAP_TRACE=$trace with_preload "$preload" "$@" >/dev/null
  "$replay" "$trace" --check >"$folder/said" || fail "$program: the replay has other pairs" >&2
  frames=$(sed -n 's/^\([0-9]*\) frames have the program.s pairs, 0 have others, of 0 it is not known$/\1/p' "$folder/said")
  geoms=$(sed -n '1s/.* precision, \([0-9]*\) geoms.*/\1/p' "$folder/said")
  "$replay" "$trace" --threads "1,$(nproc)" --spaces hash,sap --turns "${TURNS:-5}" --csv "$folder/table.csv" >/dev/null
  tail -n +2 "$folder/table.csv" | sed "s/^/$program,${frames:?},${geoms:?},/; s/\$/,$machine/" >>"$csv"
  if [ -x "$benchmark" ]; then
    "$benchmark" "--trace=$trace" --scenes=trace --threads=1 --csv="$folder/peers.csv" --peers="$peer_names" >/dev/null 2>&1
    [ -e "$peers" ] || head -n 1 "$folder/peers.csv" | sed 's/^/program,/' >"$peers"
    tail -n +2 "$folder/peers.csv" | sed "s/^/$program,/" >>"$peers"
  fi
  echo "$program: $frames frames, $geoms geoms"
  rm -f "$trace" "$trace".*
}

if [ -x "$build/tests/preload/demo_boxstack" ]; then
  record "ODE demo_boxstack" "$build/tests/preload/demo_boxstack"
fi
if /usr/bin/python3 -c 'import ode' 2>/dev/null; then
  for space in hash nested; do record "PyODE $space" /usr/bin/python3 pyode_pile.py $space 1000 60; done
else
  echo "left out: PyODE (python3-pyode)" >&2
fi
if [ -x "$build/tests/preload/dart-scene" ]; then
  for scene in columns shapes; do record "DART $scene" "$build/tests/preload/dart-scene" $scene 1001 20; done
else
  echo "left out: DART (libdart-collision-ode-dev)" >&2
fi
