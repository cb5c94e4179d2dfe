#!/usr/bin/env bash
# build.sh larger|smaller SOURCE ODE BUILD TARGET...
#
# Makes a lookalike of a fork (lookalike.sh), builds it and, in a directory of its own, these targets of this project
# against its headers and library as they are named. ODE's own assertions are on. Optimised a little, for
# the sake of the property tests.
. "$(dirname "$0")/../support/script.sh"
kind=$1 source=$2 ode=$3 build=$4
shift 4
jobs=$(nproc) here=$(cd "$(dirname "$0")" && pwd)

"$here/lookalike.sh" "$kind" "$ode" "$build/ode"
quietly cmake -S "$build/ode" -B "$build/ode-build" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_POLICY_VERSION_MINIMUM=3.5 \
  -DCMAKE_INSTALL_PREFIX="$build/ode-prefix" -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=ON \
  -DODE_WITH_OU="$([ "$kind" = smaller ] && echo ON || echo OFF)" \
  -DODE_WITH_LIBCCD=OFF -DODE_WITH_DEMOS=OFF -DODE_WITH_TESTS=OFF
quietly cmake --build "$build/ode-build" --parallel "$jobs"
rm -rf "$build/ode-prefix"
cmake --install "$build/ode-build" >/dev/null
"$here/headers.sh" "$kind" "$build/ode" "$build/ode-prefix"
library=$(find "$build/ode-prefix/lib" -name 'libode*.so')

# What was found is told where it is looked for, not where an earlier run has left it.
cmake -S "$source" -B "$build/project" -UODE_PARALLEL_SAP_CHECKED -DCMAKE_BUILD_TYPE=Debug \
  -DCMAKE_CXX_FLAGS_DEBUG="-O1 -g1" -DODE_PARALLEL_SAP_CUDA=OFF -DODE_PARALLEL_SAP_EXAMPLES=OFF -DODE_PARALLEL_SAP_ODE=HEADERS \
  -DODE_PARALLEL_SAP_ODE_INCLUDE_DIRS="$build/ode-prefix/include" \
  -DODE_PARALLEL_SAP_ODE_PRIVATE_DIRS="$build/ode/ode/src;$build/ode/ou/include;$build/ode/made;$build/ode/deps/threadpool" \
  -DODE_PARALLEL_SAP_ODE_LIBRARY="$library" -DODE_PARALLEL_SAP_ODE_DEFINITIONS=dIDEDOUBLE | tee "$folder/said"
layout="dxGeom $([ "$kind" = larger ] && echo 200 || echo 144) bytes, "
grep -q "^-- ODE of a fork: .*$layout" "$folder/said" || fail "not the layout of a fork: $layout"
cmake --build "$build/project" --parallel "$jobs" --target "$@"

# The installed header finds the fork's.
cmake --install "$build/project" --prefix "$build/installed" --component development >/dev/null
eval "flags=($(PKG_CONFIG_PATH=$(dirname "$(find "$build/installed" -name ode-parallel-sap.pc)") pkg-config --cflags ode-parallel-sap))"
echo '#include <ode_parallel_sap/parallel_sap_space.h>' | "${CC:-cc}" "${flags[@]}" -fsyntax-only -x c -
