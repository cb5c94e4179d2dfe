#!/usr/bin/env bash
# misfit.sh PRELOAD ODD_LAYOUT PROGRAM
#
# With an ODE that is laid out otherwise a program keeps its spaces, and the reason is said once.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
with_preload "$2" "$3" >"$folder/stock"
ODE_PARALLEL_SAP_STATS=1 with_preload "$1"$'\n'"$2" "$3" >"$folder/preloaded" 2>"$folder/said"
cat "$folder/said"
cmp "$folder/stock" "$folder/preloaded"
[ "$(grep -c 'nothing is replaced' "$folder/said")" -eq 1 ]
grep -q '^ode-parallel-sap: nothing is replaced: .* differs from the version this was built for: .*sublevel' "$folder/said"
[ "$(grep -c ' 0 .* spaces replaced' "$folder/said")" -eq 4 ]
