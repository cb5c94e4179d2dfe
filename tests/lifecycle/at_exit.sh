#!/usr/bin/env bash
# at_exit.sh PROGRAM
#
# ODE_PARALLEL_SAP_STATS=1 prints of a space once, also where the process ends before the space.
# PROGRAM is exit_program.cpp.
set -u
said=$(mktemp)
trap 'rm -f "$said"' EXIT
for way in left closed handler callback destroyed late thread busy fork; do
  frames='10 frames'
  [ $way != callback ] || frames='9 frames' # the last one never ends
  [ $way != busy ] || frames='[0-9]* frames'
  ODE_PARALLEL_SAP_STATS=1 "$1" $way >"$said" 2>&1
  status=$?
  lines=$(grep -c "parallel SAP space 0x[0-9a-f]*: $frames" "$said")
  if [ $status -ne 0 ] || [ "$lines" -ne 1 ]; then
    cat "$said"
    echo "$way: exit status $status, $lines times '$frames'"
    exit 1
  fi
  [ -z "$("$1" $way 2>&1)" ] || { echo "$way: something is said without being asked"; exit 1; }
done
