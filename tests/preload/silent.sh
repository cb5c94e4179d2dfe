#!/usr/bin/env bash
# silent.sh PRELOAD SKIP PROGRAM [ARGUMENT...]
#
# The program prints the same pairs whether the spaces of the preload library look at each geom or
# are told by it what changed, with pairs at rest left out (SKIP 1) or not, and without these the
# same as with ODE's spaces. A change that the library does not intercept would be found by
# ODE_PARALLEL_SAP_NOTIFIED=check.
. "$(dirname "$0")/with_preload.sh"
preload=$1
export ODE_PARALLEL_SAP_SKIP_ASLEEP=$2 ODE_PARALLEL_SAP_SKIP_STATIC=$2
shift 2

"$@" >"$folder/stock"
[ "$(cut -d: -f2 "$folder/stock" | sort -u | wc -l)" -gt 5 ] || fail "the pairs are always the same"
for notified in 0 1 check; do
  ODE_PARALLEL_SAP_NOTIFIED=$notified with_preload "$preload" "$@" >"$folder/$notified" 2>"$folder/said"
  [ ! -s "$folder/said" ] || fail "that was said with $notified"
done
with_preload "$preload" "$@" >"$folder/default"
for notified in 1 check default; do cmp "$folder/0" "$folder/$notified"; done
[ "$ODE_PARALLEL_SAP_SKIP_ASLEEP" = 1 ] || cmp "$folder/stock" "$folder/0"
