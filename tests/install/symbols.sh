#!/usr/bin/env bash
# symbols.sh LIBRARY HEADER STAND_INS VERSION [PRELOAD]
#
# The library exports what the public header declares, and the one function of the header STAND_INS,
# for the preload library; its SONAME is the major number of VERSION.
. "$(dirname "$0")/../support/script.sh"
library=$1 header=$2 stand_ins=$3 version=$4
declared() { sed -n 's/^ODE_PARALLEL_SAP_API .*[ *]\(d[A-Za-z0-9]*\)(.*/\1/p' "$1"; }
[ "$(declared "$stand_ins")" = dParallelSAPGetStandIns ] || fail "$stand_ins declares more than one function"
promised=$({ declared "$header"; declared "$stand_ins"; } | sort)
exported=$(nm -D --defined-only "$library" | awk '{ print $3 }' | sort)
diff <(echo "$promised") <(echo "$exported") || fail "headers (<) and library (>) differ"
[ "$(wc -l <<<"$promised")" -gt 10 ] || fail "the header was not understood"
readelf -d "$library" | grep -q "SONAME.*\[libode-parallel-sap.so.${version%%.*}\]"
# What only a machine with a GPU has must not be asked for by the loader; no memory may be writable
# and executable.
! readelf -d "$library" | grep 'NEEDED.*cuda' || fail "the library cannot be loaded without CUDA"
! readelf -lW "$library" | grep -E '(LOAD|GNU_STACK) .* RWE ' || fail "the library has memory that is writable and executable"
[ $# -lt 5 ] || ! readelf -d "$5" | grep 'NEEDED.*\(libode\|libstdc\|libgomp\|libomp\)' ||
  fail "the preload library brings these into every program"
