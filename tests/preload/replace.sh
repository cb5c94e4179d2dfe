#!/usr/bin/env bash
# replace.sh PRELOAD PROGRAM
#
# ODE_PARALLEL_SAP_REPLACE says which of the spaces of stock_program.c are replaced: it makes one or two
# of each kind.
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2

# expect LIST KIND...: with LIST, these kinds are replaced and no other
expect() {
  local list=$1 kind wanted
  shift
  ODE_PARALLEL_SAP_REPLACE=$list ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" "$program" 2>"$folder/said" >/dev/null
  for kind in simple hash sap quadtree; do
    wanted="0 $kind spaces replaced, [1-9][0-9]* left"
    [[ " $* " != *" $kind "* ]] || wanted="[1-9][0-9]* $kind spaces replaced, 0 left"
    grep -q "^ode-parallel-sap: $wanted$" "$folder/said" || fail "$list: $kind"
  done
}
expect hash hash
expect sap,quadtree sap quadtree
expect 'simple, hash' simple hash
expect none
expect ''
expect heap,quadtree,hashes quadtree
for name in heap hashes; do
  [ "$(grep -c "^ode-parallel-sap: ODE_PARALLEL_SAP_REPLACE names $name, which is no kind of space .* and is ignored$" "$folder/said")" -eq 1 ] ||
    fail "$name is not named once"
done
