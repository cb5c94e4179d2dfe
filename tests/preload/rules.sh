#!/usr/bin/env bash
# rules.sh PRELOAD PROGRAM
#
# ODE_PARALLEL_SAP_SKIP_STATIC, _SKIP_ASLEEP, _CULL_PLANES and _TOLERANCE reach a program that knows
# nothing of them: each leaves out, or adds, its own pair of those of rules_program.c.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2

# expect VARIABLE=VALUE... -- KIND...: in each of the frames these pairs are reported, and no other
expect() {
  local -a variables=()
  while [ "$1" != -- ]; do variables+=("ODE_PARALLEL_SAP_$1") && shift; done
  shift
  local wanted frame frames=0
  wanted=$(printf '%s\n' "$@" | sort)
  while read -r frame; do
    frames=$((frames + 1))
    [ "$(tr ' ' '\n' <<<"$frame" | sort)" = "$wanted" ] || {
      echo "${variables[*]}, frame $frames: $frame instead of $*"
      exit 1
    }
  done < <(export "${variables[@]}" && with_preload "$preload" "$program")
  [ "$frames" -eq 3 ] || { echo "${variables[*]}: $frames frames"; exit 1; }
}
expect STATS=0 -- static asleep plane awake
expect SKIP_STATIC=1 -- asleep plane awake
expect SKIP_ASLEEP=1 -- static plane awake
expect CULL_PLANES=1 -- static asleep awake
expect TOLERANCE=0.2 -- static asleep plane awake near
expect TOLERANCE=0.01 -- static asleep plane awake
expect SKIP_STATIC=1 SKIP_ASLEEP=1 CULL_PLANES=1 -- awake
expect SKIP_STATIC=0 SKIP_ASLEEP=0 CULL_PLANES=0 TOLERANCE=0 -- static asleep plane awake
expect REPLACE=none SKIP_STATIC=1 -- static asleep plane awake

said=$(ODE_PARALLEL_SAP_SKIP_STATIC=yes with_preload "$preload" "$program" 2>&1 >/dev/null)
grep -q 'ODE_PARALLEL_SAP_SKIP_STATIC=yes is neither 0 nor 1 and is ignored' <<<"$said" ||
  { echo "$said"; echo "yes is not refused"; exit 1; }
