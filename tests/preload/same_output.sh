#!/usr/bin/env bash
# same_output.sh PRELOAD REPLACED PROGRAM [ARGUMENT...]
#
# What the program prints must be the same with and without the preload library, and REPLACED must be
# the number of spaces that were replaced.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 expected=$2
shift 2

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$@" >"$folder/stock"
ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" "$@" >"$folder/preloaded" 2>"$folder/said"
cmp "$folder/stock" "$folder/preloaded"
[ -s "$folder/stock" ] || { echo "the program prints nothing"; exit 1; }
replaced=$(awk '/ spaces replaced/ { sum += $2 } END { print sum + 0 }' "$folder/said")
cat "$folder/said"
[ "$replaced" -eq "$expected" ] || { echo "$replaced spaces were replaced, not $expected"; exit 1; }
