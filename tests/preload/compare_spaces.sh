#!/usr/bin/env bash
# compare_spaces.sh RECORDER PRELOAD NAME PROGRAM [ARGUMENT...]
#
# Runs a program twice under the pair recorder, with the spaces it makes and with those replaced,
# and compares what the spaces reported, call by call. Prints a line for the table of results. Fails
# if the pairs owed differ in any call, if the replaced spaces report a pair too many or too few, or
# if nothing was compared.
set -euo pipefail
recorder=$1 preload=$2 name=$3
shift 3

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
PAIR_RECORD=$folder/stock LD_PRELOAD=$recorder "$@" >"$folder/stock.out" 2>&1 </dev/null ||
  { cat "$folder/stock.out"; echo "$name fails without the preload library"; exit 1; }
PAIR_RECORD=$folder/replaced LD_PRELOAD="$recorder $preload" ODE_PARALLEL_SAP_STATS=1 \
  "$@" >"$folder/replaced.out" 2>&1 </dev/null ||
  { cat "$folder/replaced.out"; echo "$name fails with the preload library"; exit 1; }

fail() {
  echo "$name: $*"
  cat "$folder/replaced.out"
  exit 1
}
IFS=, read -r calls geoms owed unowed missed _ seconds < <(tail -n 1 "$folder/stock")
IFS=, read -r _ _ own_owed own_unowed own_missed own_repeated own_seconds < <(tail -n 1 "$folder/replaced")
grep -Eq '^ode-parallel-sap: [1-9][0-9]* [a-z]+ spaces replaced' "$folder/replaced.out" || fail "no space was replaced"
[ "$owed" -gt 0 ] || fail "no pairs at all"
[ "$own_unowed $own_missed $own_repeated" = "0 0 0" ] ||
  fail "replaced spaces reported $own_unowed pairs too many, $own_missed too few, $own_repeated twice"

# Where the stock space misses a pair the program goes another way from there on.
if [ "$missed" -eq 0 ]; then
  cmp <(head -n -2 "$folder/stock") <(head -n -2 "$folder/replaced") || fail "the pairs differ"
  same=$calls
else
  same=$(cmp <(head -n -2 "$folder/stock") <(head -n -2 "$folder/replaced") | sed -n 's/.* line //p')
  same=$((${same:-$((calls + 1))} - 1))
fi
awk -v name="$name" -v calls="$calls" -v same="$same" -v geoms="$geoms" -v owed="$owed" -v unowed="$unowed" \
  -v missed="$missed" -v stock="$seconds" -v own="$own_seconds" 'BEGIN {
    printf "%s,%d,%d,%d,%.1f,%d,%d,%.4f,%.4f\n", name, calls, same, geoms, owed / calls, unowed, missed,
           1000 * stock / calls, 1000 * own / calls }'
