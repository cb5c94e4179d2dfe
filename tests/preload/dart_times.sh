#!/usr/bin/env bash
# dart_times.sh PRELOAD DART_SCENE [THREADS...]
#
# What a step of DART takes, and what of it collision, in ms: with its own hash space, and under the
# preload library with contacts found beforehand off, auto and on, for each number of threads (1 2). Each
# is the run of REPEATS (5) whose collision took least, in turn with the others. Quiet machines only.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2
shift 2
[ $# -gt 0 ] || set -- 1 2

# run THREADS CONTACTS SCENE: prints the two times
run() {
  if [ "$2" = stock ]; then
    OMP_NUM_THREADS=$1 "$program" "$3" 1001 40 2>&1 >/dev/null
  else
    OMP_NUM_THREADS=$1 ODE_PARALLEL_SAP_CONTACTS=$2 with_preload "$preload" "$program" "$3" 1001 40 2>&1 >/dev/null
  fi | sed -n 's/^a step: \([0-9.]*\) ms, collision of a step: \([0-9.]*\) ms$/\1 \2/p'
}

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for ((i = 0; i < ${REPEATS:-5}; ++i)); do
  for scene in shapes columns; do
    run 1 stock $scene >>"$folder/$scene stock 1"
    for threads; do
      for contacts in off auto on; do run "$threads" $contacts $scene >>"$folder/$scene $contacts $threads"; done
    done
  done
done
echo "scene,contacts,threads,step_ms,collision_ms"
for file in "$folder"/*; do
  sort -g -k2 "$file" | head -n 1 | awk -v OFS=, -v what="$(basename "$file" | tr ' ' ,)" '{ print what, $1, $2 }'
done
