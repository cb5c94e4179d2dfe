#!/usr/bin/env bash
# meshes.sh PROPERTY-TESTS
#
# The pairs of real meshes; skipped (77) where no directory of them is named.
set -euo pipefail
[ "${ODE_PARALLEL_SAP_MESHES:-}" ] || { echo "Skipped: ODE_PARALLEL_SAP_MESHES names no directory of meshes" && exit 77; }
exec "$1" "[meshes-data]"
