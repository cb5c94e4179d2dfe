#!/usr/bin/env bash
# same_output.sh PRELOAD ORDER LEAST MOST PROGRAM [ARGUMENT...]
#
# What PROGRAM prints is the same whether or not contacts are found before it asks for them, on one thread and
# on four; and of LEAST to MOST pairs they are. Where ORDER is `any`, it is also what it prints without the
# preload library, whose spaces report in another order. Ends with status 77 where PROGRAM does.
. "$(dirname "$0")/with_preload.sh"
preload=$1 order=$2 least=$3 most=$4
shift 4
program=("$@")

export ODE_PARALLEL_SAP_TEST_GRAIN=1 ODE_PARALLEL_SAP_STATS=1

# run CONTACTS THREADS: sets `told` and `used`
run() {
  local status=0
  ODE_PARALLEL_SAP_CONTACTS=$1 ODE_PARALLEL_SAP_THREADS=$2 with_preload "$preload" "${program[@]}" \
    >"$folder/$1" 2>"$folder/said" || status=$?
  [ $status -ne 77 ] || { cat "$folder/$1"; exit 77; }
  [ $status -eq 0 ] || fail "ends with status $status ($1, $2 threads)"
  cmp "$folder/off" "$folder/$1" || fail "the prints of $1 differ ($2 threads)"
  read -r told used < <(
    sed -n 's/^ode-parallel-sap: \([0-9]*\) pairs collided before .*: \([0-9]*\) of them .*/\1 \2/p' "$folder/said")
}

run off 4
[ "$told" -eq 0 ] || fail "$told pairs were collided with off"
[ -s "$folder/off" ] || fail "nothing was printed"
for threads in 1 4; do
  run on $threads
  echo "$threads threads: $used of $told used"
  [ "$used" -ge "$least" ] && [ "$used" -le "$most" ] || fail "not $least to $most were used"
done
run auto 1
[ "$told" -eq 0 ] || fail "$told pairs were collided by one thread"
run auto 4
if [ "$order" = any ]; then "${program[@]}" | cmp - "$folder/off" || fail "the prints differ from those with ODE's spaces"; fi
