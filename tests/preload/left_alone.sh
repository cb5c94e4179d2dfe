#!/usr/bin/env bash
# left_alone.sh PRELOAD COMPLAINT PROGRAM [LIBRARY]
#
# With an ODE that does not fit, a program prints what it prints without the preload library, and the reason is
# said once. LIBRARY makes a misfit of the program's ODE.
# left_alone.sh PRELOAD
#
# A program without ODE stays without it, and nothing is said.
. "$(dirname "$0")/with_preload.sh"
preload=$1
if [ $# -eq 1 ]; then
  ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" cat /proc/self/maps >"$folder/said" 2>&1
  grep -q "$(basename "$preload")" "$folder/said" || fail "$preload was not loaded"
  ! grep -E 'libode|libstdc|libgomp|ode-parallel-sap:' "$folder/said" | grep -v "/$(basename "$preload")" ||
    fail "the preload library said this, or brought it along"
  exit 0
fi

with_preload "${4-}" "$3" >"$folder/stock"
ODE_PARALLEL_SAP_STATS=1 with_preload "$preload${4+$'\n'$4}" "$3" >"$folder/preloaded" 2>"$folder/said"
cat "$folder/said"
[ -s "$folder/stock" ]
cmp "$folder/stock" "$folder/preloaded"
[ "$(grep -c 'nothing is replaced' "$folder/said")" -eq 1 ]
grep -q "^ode-parallel-sap: nothing is replaced: .*$2" "$folder/said"
! grep -q ': [1-9][0-9]* .* spaces replaced' "$folder/said"
