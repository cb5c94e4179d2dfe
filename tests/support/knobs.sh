#!/usr/bin/env bash
# knobs.sh PROPERTY_TESTS
#
# What tests/README.md says of the environment variables of the tests.
set -euo pipefail
program=$1
unset ODE_PARALLEL_SAP_TEST_SEED ODE_PARALLEL_SAP_TEST_SCALE ODE_PARALLEL_SAP_TEST_ONLY
said=
fail() {
  tail -n 20 <<<"$said"
  echo "$*"
  exit 1
}
# run VARIABLE=VALUE... -- ARGUMENT...: sets said and status
run() {
  local -a variables=()
  while [ "$1" != -- ]; do variables+=("$1"); shift; done
  shift
  status=0
  said=$(env "${variables[@]}" "$program" "$@" 2>&1) || status=$?
}

run ODE_PARALLEL_SAP_TEST_ONLY="no such" -- "[api]"
[ "$status" -eq 77 ] || fail "a configuration that is not to be had ends with $status"
grep -q '^SKIPPED: all of it$' <<<"$said" || fail "nothing is said of what is skipped"
run ODE_PARALLEL_SAP_TEST_ONLY="cpu, sweep" -- -s "Closed intervals*"
[ "$status" -eq 0 ] && grep -q 'cpu, sweep' <<<"$said" || fail "no sweep with cpu, sweep"
! grep -q 'brute force\|axis lists' <<<"$said" || fail "not only the sweep"

run ODE_PARALLEL_SAP_TEST_SEED=12345 -- -s "Queries follow the formula*"
[ "$status" -eq 0 ] && grep -q 'ODE_PARALLEL_SAP_TEST_SEED=12345' <<<"$said" || fail "the seed is not taken"
run ODE_PARALLEL_SAP_TEST_SEED=12345 -- -s "Bounds and planes of every kind*"
grep -q 'ODE_PARALLEL_SAP_TEST_SEED=12346' <<<"$said" || fail "the second run has not the next seed"

# Runs are as many assertions.
runs() {
  run "$1" -- "Bounds and planes of every kind*"
  [ "$status" -eq 0 ] || fail "$1 ends with $status"
  sed -n 's/.*(\([0-9]*\) assertions.*/\1/p' <<<"$said"
}
tenth=$(runs ODE_PARALLEL_SAP_TEST_SCALE=0.1) whole=$(runs ODE_PARALLEL_SAP_TEST_SCALE=1)
[ "$whole" -gt 0 ] && [ "$((10 * tenth))" -eq "$whole" ] || fail "a tenth of $whole runs is $tenth"
run ODE_PARALLEL_SAP_TEST_SCALE=-1 -- "Bounds and planes of every kind*"
[ "$status" -eq 1 ] || fail "a scale that makes no sense ends with $status"
