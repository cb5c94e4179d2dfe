#!/usr/bin/env bash
# ranges.sh <program> <variable> <recorder>
# Runs the program with the recorder as the profiler that the variable names, and without one: the ranges of all stages
# come in their order, and all that begin end. Where no geom moved, update is the only stage before the report.
set -euo pipefail
program=$1 variable=$2 recorder=$3

stages() { for stage in "$@"; do printf '+ %s\n-\n' "$stage"; done; }
found() { stages update synchronise extract filter "$@"; }
still() { stages update "$@"; }
expected=$(
  echo collide
  echo "domain ode-parallel-sap"
  found report
  echo contacts
  still narrow report
  echo "pairs with events"
  still events report
  echo nested
  still
  echo "+ report"
  found report
  echo "-"
  echo thrown
  still
  printf '+ report\n-\ncaught\nrays\n'
  stages rays
  echo end)
got=$(env "$variable=$recorder" "$program" 2>&1)
diff <(echo "$expected") <(echo "$got")
diff <(echo "$expected" | grep -v -e '^[-+]' -e '^domain') <("$program" 2>&1)
echo "ranges as expected"
