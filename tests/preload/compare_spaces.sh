#!/usr/bin/env bash
# compare_spaces.sh RECORDER PRELOAD NAME PROGRAM [ARGUMENT...]
#
# Runs a program twice under the pair recorder, with the spaces it makes and with those replaced,
# and compares what the spaces reported, call by call. Prints a line for the table of results, with
# the times of the quickest of REPEATS runs (1). Fails if the pairs owed differ in any call, if the
# replaced spaces report a pair too many or too few, or if nothing was compared.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
recorder=$1 preload=$2 name=$3
shift 3

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

fail() {
  cat "$folder/out" "$folder/said"
  echo "$name: $*"
  exit 1
}

# run RECORD LIBRARIES PROGRAM...: sets `seconds` to the least of all repetitions
run() {
  local record=$1 libraries=$2 once
  shift 2
  seconds=
  for ((i = 0; i < ${REPEATS:-1}; ++i)); do
    PAIR_RECORD=$record ODE_PARALLEL_SAP_STATS=1 with_preload "$libraries" "$@" \
      >"$folder/out" 2>"$folder/said" </dev/null ||
      fail "ends with status $? under $libraries"
    once=$(tail -n 1 "$record" | cut -d, -f7)
    seconds=$(printf '%s\n' ${seconds:+"$seconds"} "$once" | sort -g | head -n 1)
  done
}

run "$folder/stock" "$recorder" "$@"
stock_seconds=$seconds
run "$folder/replaced" "$recorder"$'\n'"$preload" "$@"

IFS=, read -r calls geoms owed unowed missed _ < <(tail -n 1 "$folder/stock")
IFS=, read -r _ _ _ own_unowed own_missed own_repeated _ < <(tail -n 1 "$folder/replaced")
replaced=$(sed -n 's/^ode-parallel-sap: \([1-9][0-9]*\) \([a-z]*\) spaces replaced.*/\1 \2/p' "$folder/said" | paste -sd+)
[ -n "$replaced" ] || fail "no space was replaced"
[ "$owed" -gt 0 ] || fail "no pairs at all"
[ "$own_unowed $own_missed $own_repeated" = "0 0 0" ] ||
  fail "replaced spaces reported $own_unowed pairs too many, $own_missed too few, $own_repeated twice"

# Where the stock space misses a pair the program goes another way from there on.
same=$calls
if ! cmp -s <(head -n -2 "$folder/stock") <(head -n -2 "$folder/replaced"); then
  [ "$missed" -gt 0 ] || fail "the pairs differ"
  same=$(($(cmp <(head -n -2 "$folder/stock") <(head -n -2 "$folder/replaced") | sed -n 's/.* line //p') - 1))
fi
awk -v OFS=, -v name="$name" -v replaced="$replaced" -v calls="$calls" -v same="$same" -v geoms="$geoms" \
  -v owed="$owed" -v unowed="$unowed" -v missed="$missed" -v stock="$stock_seconds" -v own="$seconds" 'BEGIN {
    print name, replaced, geoms, calls, same, sprintf("%.1f", owed / calls), unowed, missed,
          sprintf("%.5f", 1000 * stock / calls), sprintf("%.5f", 1000 * own / calls) }'
