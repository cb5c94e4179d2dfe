#!/usr/bin/env bash
# left_alone.sh PRELOAD COMPLAINT FAKE_PROGRAM...
#
# With an ODE that does not fit, the programs keep its spaces, and the reason is said once.
# left_alone.sh PRELOAD
#
# A program without ODE stays without it, and nothing is said.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1
if [ $# -eq 1 ]; then
  said=$(ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" cat /proc/self/maps)
  grep -q "$(basename "$preload")" <<<"$said" || { echo "$preload was not loaded"; exit 1; }
  if grep -E 'libode|libstdc|libgomp' <<<"$said" | grep -v "$(basename "$preload")"; then
    echo "the preload library brought these along"
    exit 1
  fi
  said=$(ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" cat /dev/null 2>&1)
  [ -z "$said" ] || { echo "$said"; exit 1; }
  exit 0
fi

said=$(with_preload "$preload" "$3" 2>&1)
echo "$said"
[ "$(grep -c '^stock spaces$' <<<"$said")" -eq 3 ]
[ "$(grep -c 'nothing is replaced' <<<"$said")" -eq 1 ]
grep -q "nothing is replaced: .*$2" <<<"$said"
