#!/usr/bin/env bash
# knobs.sh PROPERTY_TESTS
#
# What tests/README.md says of the environment variables of the tests.
. "$(dirname "$0")/script.sh"
program=$1
unset ODE_PARALLEL_SAP_TEST_SEED ODE_PARALLEL_SAP_TEST_SCALE ODE_PARALLEL_SAP_TEST_ONLY
# run STATUS VARIABLE=VALUE ARGUMENT...: the program must end with this status
run() {
  local status=0
  env "ODE_PARALLEL_SAP_TEST_$2" "$program" "${@:3}" >"$folder/said" 2>&1 || status=$?
  [ $status -eq "$1" ] || fail "$2 ends with $status"
}
says() { grep -q "$1" "$folder/said" || fail "does not say $1"; }

run 77 ONLY="no such" "[api]"
says '^SKIPPED: all of it$'
run 0 ONLY="cpu, sweep" -s "Bounds and planes of every kind*"
says 'cpu, sweep'
! grep -q 'brute force\|axis lists' "$folder/said" || fail "not only the sweep"

run 0 SEED=12345 -s "Bounds and planes of every kind*"
says 'ODE_PARALLEL_SAP_TEST_SEED=12345'
says 'ODE_PARALLEL_SAP_TEST_SEED=12346' # the second run has the next seed

# Runs are as many assertions.
run 0 SCALE=0.1 "Bounds and planes of every kind*"
tenth=$(sed -n 's/.*(\([0-9]*\) assertions.*/\1/p' "$folder/said")
run 0 SCALE=1 "Bounds and planes of every kind*"
says "($((10 * tenth)) assertions"
run 1 SCALE=-1 "Bounds and planes of every kind*"
