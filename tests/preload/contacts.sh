#!/usr/bin/env bash
# contacts.sh PRELOAD PROGRAM SCENARIO ORDER LEAST MOST
#
# What PROGRAM (collide_program.cpp) prints in a scenario is the same whether or not contacts are found
# before it asks for them, on one thread and on four; and of LEAST to MOST pairs they are. Where ORDER is
# `any`, it is also what it prints without the preload library, whose spaces report in another order.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2 scenario=$3 order=$4 least=$5 most=$6

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export ODE_PARALLEL_SAP_TEST_GRAIN=1 ODE_PARALLEL_SAP_STATS=1

# run CONTACTS THREADS: sets `told` and `used`
run() {
  ODE_PARALLEL_SAP_CONTACTS=$1 ODE_PARALLEL_SAP_THREADS=$2 with_preload "$preload" "$program" "$scenario" \
    >"$folder/$1" 2>"$folder/said" || fail "ends with status $? ($1, $2 threads)"
  read -r told used < <(sed -n 's/^ode-parallel-sap: \([0-9]*\) pairs collided before .*: \([0-9]*\) of them .*/\1 \2/p' "$folder/said")
}
fail() {
  cat "$folder/said"
  echo "$scenario: $*"
  exit 1
}
compare() { cmp "$folder/off" "$folder/$1" || fail "the prints of $1 differ ($2 threads)"; }

run off 4
[ "$told" -eq 0 ] || fail "$told pairs were collided with off"
[ -s "$folder/off" ] || fail "nothing was printed"
for threads in 1 4; do
  run on $threads
  compare on $threads
  echo "$scenario, $threads threads: $used of $told used"
  [ "$used" -ge "$least" ] && [ "$used" -le "$most" ] || fail "not $least to $most were used"
done
run auto 1
[ "$told" -eq 0 ] || fail "$told pairs were collided by one thread"
compare auto 1
run auto 4
compare auto 4
if [ "$order" = any ]; then
  "$program" "$scenario" >"$folder/stock"
  compare stock 1
fi
