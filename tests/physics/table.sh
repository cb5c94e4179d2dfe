#!/usr/bin/env bash
# table.sh <physics-table> <double or single>: rows come one at a time and are resumed.
set -uo pipefail
table=$1 precision=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
rows=$folder/rows.csv

fail() { echo "FAILED: $*" >&2 && exit 1; }
measure() { # exit code, how many of how many rows, arguments
  local code=$1 said=$2
  shift 2
  "$table" measure "$rows" "$@" 2>"$folder/said"
  local was=$?
  [ $was = "$code" ] || fail "measure $*: exit code $was, not $code"
  [ "$(tail -1 "$folder/said")" = "$said rows" ] || fail "measure $*: $(tail -1 "$folder/said"), not $said rows"
}
count() { grep -c "^$precision" "$rows"; }

measure 75 "0 of 2" 0 pendulum
measure 0 "2 of 2" 60 pendulum
cp "$rows" "$folder/first"
measure 0 "0 of 0" 60 pendulum
cmp "$rows" "$folder/first" || fail "a call without anything to do changed rows"

# Cut short, as by a kill: the last row is played again, the others stay.
head -c -9 "$folder/first" >"$rows"
measure 0 "1 of 1" 60 pendulum
cmp "$rows" "$folder/first" || fail "a row that was cut short is not as it was"

# A rescue that was not looked for is looked for when it is asked for; where the time is up it stays so.
ball="a ball of 0.1 m that falls"
measure 0 "1 of 1" 60 "$ball" 0
grep -q "$ball.*\"not looked for\",0" "$rows" || fail "no row without a rescue"
measure 75 "0 of 1" 0 "$ball" 0.2
grep -q "$ball.*\"not looked for\",0" "$rows" || fail "a row without a rescue is gone"
measure 0 "1 of 1" 60 "$ball" 0.2
grep -q "$ball.*\"not looked for\"" "$rows" && fail "no rescue was looked for"
[ "$(count)" = 3 ] || fail "$(count) rows of three extremes"
places=$(grep -n "pendulum\|$ball" "$rows" | cut -d: -f1 | tr -d '\n')
[ "$places" = 234 ] && grep -q "$ball" <(tail -1 "$rows") || fail "rows are not in the order of extremes"

sed -i 1s/depth/width/ "$rows"
"$table" measure "$rows" 1 pendulum 2>"$folder/said" && fail "columns of another version were taken"
grep -q "other columns" "$folder/said" || fail "not said why: $(cat "$folder/said")"
