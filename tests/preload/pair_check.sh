#!/usr/bin/env bash
# pair_check.sh CHECK PRELOAD PROGRAM [ARGUMENT...]
#
# Runs a program whose spaces are replaced under pair_check.cpp: every call must report the owed pairs, and
# there must be some. Ends with status 77 where the program does.
. "$(dirname "$0")/with_preload.sh"
check=$1 preload=$2
shift 2
ODE_PARALLEL_SAP_STATS=1 with_preload "$check"$'\n'"$preload" "$@" 2>&1 </dev/null | tee "$folder/said"
grep -q '^ode-parallel-sap: [1-9][0-9]* [a-z]* spaces replaced' "$folder/said" || fail "no space was replaced"
grep -q '^pair check: [1-9][0-9]* calls, [1-9][0-9]* pairs, all right$' "$folder/said" || fail "no pairs"
