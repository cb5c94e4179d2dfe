#!/usr/bin/env bash
# dart_far.sh PRELOAD DART_SCENE
#
# DART with a small body at -1e9 m: its own hash space ends the program, a replaced one goes on, and the
# body beside it comes to lie on the ground.
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2

status=0
(ulimit -c 0 && exec "$program" far) >"$folder/out" 2>"$folder/said" || status=$?
[ $status -eq 134 ] || fail "without the preload library: status $status, not 134, an abort"
grep -q 'assertion "aabbBound >= dMinIntExact' "$folder/said" || fail "aborted by something else"

status=0
ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" "$program" far >"$folder/out" 2>"$folder/said" || status=$?
cat "$folder/out"
[ $status -eq 0 ] || fail "with it: status $status"
grep -q '^ode-parallel-sap: 1 hash spaces replaced' "$folder/said" || fail "no space was replaced"
# A box of height 1 lies on the ground, and the body that is far away has fallen from 1 m for 0.3 s.
grep -q '^2 shapes, mean height 0\.52[0-9]*, .* [1-9][0-9]* contacts ' "$folder/out"
