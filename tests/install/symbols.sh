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
# What only a machine with a GPU has must not be asked for by the loader; no memory may be writable
# and executable.
if readelf -d "$library" | grep 'NEEDED.*cuda'; then
  echo "the library cannot be loaded without CUDA"
  exit 1
fi
if readelf -lW "$library" | grep -E '(LOAD|GNU_STACK) .* RWE '; then
  echo "the library has memory that is writable and executable"
  exit 1
fi
if [ $# -eq 4 ] && readelf -d "$4" | grep 'NEEDED.*\(libode\|libstdc\|libgomp\|libomp\)'; then
  echo "the preload library brings these into every program"
  exit 1
fi
