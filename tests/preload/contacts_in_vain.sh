#!/usr/bin/env bash
# contacts_in_vain.sh PRELOAD PROGRAM
#
# In 120 frames contacts are found beforehand where PROGRAM (collide_program.cpp) asks for them, but for the
# pairs with planes and rays, and hardly ever where it does not.
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2

export ODE_PARALLEL_SAP_THREADS=4 ODE_PARALLEL_SAP_STATS=1 ODE_PARALLEL_SAP_TEST_GRAIN=1
for scenario in plain bodies classes some flags-by-frame gone; do
  calls=$(with_preload "$preload" "$program" $scenario 120 2>"$folder/said" | wc -l)
  read -r told used < <(sed -n 's/^ode-parallel-sap: \([0-9]*\) pairs collided before .*: \([0-9]*\) of them .*/\1 \2/p' "$folder/said")
  pairs=$(awk '/dSpaceCollide of/ { print $2 * $8 }' "$folder/said")
  echo "$scenario: $told of $pairs pairs collided beforehand, $used used of $calls asked for"
  [ $((100 * (told - used))) -lt $((3 * pairs)) ] || fail "too many"
  case $scenario in plain | bodies | classes)
    [ $((100 * used)) -gt $((85 * calls)) ] || fail "too few" ;;
  esac
done
