#!/usr/bin/env bash
# trace_of.sh PRELOAD REPLAY FRAMES PROGRAM [ARGUMENT...]
#
# A trace of any program replays with the pairs that the program had, in FRAMES frames or more. Ends with 77 where the
# program does.
. "$(dirname "$0")/with_preload.sh"
preload=$1 replay=$2 frames=$3
shift 3

ODE_PARALLEL_SAP_TRACE=$folder/trace with_preload "$preload" "$@" || exit $?
"$replay" "$folder/trace" --check | tee "$folder/said"
same=$(sed -n "s/^\([0-9]*\) frames have the program's pairs, 0 have others, of 0 it is not known$/\1/p" "$folder/said")
[ "${same:-0}" -ge "$frames" ] || fail "not $frames frames"
# A table of what the options give has all its rows.
"$replay" "$folder/trace" --turns 1 --threads 1,2 --tolerance 0.01 --spaces hash --csv "$folder/table.csv"
[ "$(wc -l <"$folder/table.csv")" -eq 11 ] || fail "not ten rows: $(cat "$folder/table.csv")"
# What is no whole trace is refused.
head -c -5 "$folder/trace" >"$folder/cut"
status=0
"$replay" "$folder/cut" --check 2>"$folder/said" || status=$?
[ $status -eq 2 ] && grep -q '^trace-replay: .*cut: it ends within a chunk' "$folder/said" ||
  fail "the replay of a cut trace ends with $status"
# So are wrong options; help is none.
for options in "" "--no-such-option" "$folder/trace --threads 0"; do
  status=0
  # shellcheck disable=SC2086 # they are words
  "$replay" $options >"$folder/said" 2>&1 || status=$?
  [ $status -eq 2 ] || fail "trace-replay $options ends with $status"
done
"$replay" --help >/dev/null || fail "trace-replay --help ends with $?"
