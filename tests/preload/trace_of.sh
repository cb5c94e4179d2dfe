#!/usr/bin/env bash
# trace_of.sh PRELOAD REPLAY FRAMES PROGRAM [ARGUMENT...]
#
# A trace of any program replays with the pairs that the program had, in FRAMES frames or more, and frames.py reads it,
# too. Ends with 77 where the program does.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 replay=$2 frames=$3
shift 3
reader=$(cd "$(dirname "$0")/../../examples/trace" && pwd)/frames.py
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

ODE_PARALLEL_SAP_TRACE=$folder/trace with_preload "$preload" "$@" || exit $?
"$replay" "$folder/trace" --check | tee "$folder/said"
same=$(sed -n "s/^\([0-9]*\) frames have the program's pairs, 0 have others, of 0 it is not known$/\1/p" "$folder/said")
[ "${same:-0}" -ge "$frames" ] || { echo "not $frames frames"; exit 1; }
# A table of what the options give has all its rows, and other readers find the same frames.
"$replay" "$folder/trace" --turns 1 --threads 1,2 --tolerance 0.01 --spaces hash --csv "$folder/table.csv"
[ "$(wc -l <"$folder/table.csv")" -eq 11 ] || { cat "$folder/table.csv"; echo "not ten rows"; exit 1; }
[ "$("$reader" "$folder/trace" | grep -c '^collide ')" -eq "$same" ] || { echo "frames.py finds other frames"; exit 1; }
[ "$("$replay" "$folder/trace" --pairs | grep -c '^collide .*-')" -ge 1 ] || { echo "no pairs are printed"; exit 1; }
# What is no whole trace is refused.
head -c -5 "$folder/trace" >"$folder/cut"
status=0
"$replay" "$folder/cut" --check 2>"$folder/said" || status=$?
[ $status -eq 2 ] && grep -q '^trace-replay: .*cut: it ends within a chunk' "$folder/said" ||
  { cat "$folder/said"; echo "the replay of a cut trace ends with $status"; exit 1; }
