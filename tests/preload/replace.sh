#!/usr/bin/env bash
# replace.sh PRELOAD PROGRAM
#
# ODE_PARALLEL_SAP_REPLACE says which of the spaces of stock_program.c are replaced: it makes one or two
# of each kind.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2

# expect LIST KIND...: with LIST, these kinds are replaced and no other; sets `said`
expect() {
  local list=$1 kind wanted
  shift
  said=$(ODE_PARALLEL_SAP_REPLACE=$list ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" "$program" 2>&1 >/dev/null)
  for kind in simple hash sap quadtree; do
    wanted="0 $kind spaces replaced, [1-9][0-9]* left"
    [[ " $* " != *" $kind "* ]] || wanted="[1-9][0-9]* $kind spaces replaced, 0 left"
    grep -q "^ode-parallel-sap: $wanted$" <<<"$said" || { echo "$said"; echo "$list: $kind"; exit 1; }
  done
}
expect hash hash
expect sap,quadtree sap quadtree
expect 'simple, hash' simple hash
expect none
expect ''
expect heap,quadtree,hashes quadtree
for name in heap hashes; do
  [ "$(grep -c "^ode-parallel-sap: ODE_PARALLEL_SAP_REPLACE names $name, which is no kind of space .* and is ignored$" <<<"$said")" -eq 1 ] ||
    { echo "$said"; echo "$name is not named once"; exit 1; }
done
