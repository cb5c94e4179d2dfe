#!/usr/bin/env bash
# pair_check.sh CHECK PRELOAD PROGRAM [ARGUMENT...]
#
# Runs a program whose spaces are replaced under pair_check.cpp: every call must report the owed pairs, and
# there must be some. Ends with status 77 where the program does.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
check=$1 preload=$2
shift 2
status=0
said=$(ODE_PARALLEL_SAP_STATS=1 with_preload "$check"$'\n'"$preload" "$@" 2>&1 </dev/null) || status=$?
echo "$said"
[ $status -eq 0 ] || exit $status
grep -q '^ode-parallel-sap: [1-9][0-9]* [a-z]* spaces replaced' <<<"$said" || { echo "no space was replaced"; exit 1; }
grep -q '^pair check: [1-9][0-9]* calls, [1-9][0-9]* pairs, all right$' <<<"$said" || { echo "no pairs"; exit 1; }
