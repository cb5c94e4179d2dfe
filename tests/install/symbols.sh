#!/usr/bin/env bash
# symbols.sh LIBRARY HEADER VERSION [PRELOAD]
#
# The library exports what the header declares, and the one function of the preload library; its
# SONAME is the major number of VERSION.
set -euo pipefail
library=$1 header=$2 version=$3
promised=$({ sed -n 's/^ODE_PARALLEL_SAP_API .*[ *]\(d[A-Za-z0-9]*\)(.*/\1/p' "$header"; echo dParallelSAPGetStandIns; } | sort)
exported=$(nm -D --defined-only "$library" | awk '{ print $3 }' | sort)
diff <(echo "$promised") <(echo "$exported") || { echo "header (<) and library (>) differ"; exit 1; }
[ "$(wc -l <<<"$promised")" -gt 10 ] || { echo "the header was not understood"; exit 1; }
readelf -d "$library" | grep -q "SONAME.*\[libode-parallel-sap.so.${version%%.*}\]"
# What only a machine with a GPU has must not be asked for by the loader; nothing may be executable
# and writable, nor be looked for beside the source.
needed=$(readelf -d "$library" | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p')
! grep -E 'cuda' <<<"$needed"
[ $# -lt 4 ] || [ "$(readelf -d "$4" | grep -c 'NEEDED.*\(libode\|libstdc\|libgomp\|libomp\)')" -eq 0 ]
