#!/usr/bin/env bash
# static_ode.sh SOURCE ODE FOLDER [LIBRARY]
#
# Builds ODE as a static library of position-independent code, vcpkg's default on Linux, and installs it to FOLDER. A shared
# ode-parallel-sap, which would hold an ODE of its own, is refused for it. A program that has this ODE in it and the shared
# LIBRARY, and so two, is told so in its first call.
. "$(dirname "$0")/../support/script.sh"
source=$1 ode=$2 prefix=$3 library=${4-}
rm -rf "$prefix"
quietly cmake -S "$ode" -B "$prefix/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_POLICY_VERSION_MINIMUM=3.5 \
  -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
  -DODE_DOUBLE_PRECISION=ON -DODE_WITH_OU=ON -DODE_WITH_LIBCCD=ON -DODE_WITH_DEMOS=OFF -DODE_WITH_TESTS=OFF
quietly cmake --build "$prefix/build" --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-2}" --target install
export PKG_CONFIG_PATH=$prefix/lib/pkgconfig

! cmake -S "$source" -B "$prefix/refused" -DODE_SOURCE_DIR="$ode" -DODE_PARALLEL_SAP_ODE=SYSTEM -DODE_PARALLEL_SAP_CUDA=OFF \
  -DBUILD_SHARED_LIBS=ON >"$folder/said" 2>&1 || fail "a shared library is configured with a static ODE"
grep -q 'is a static library with the static ODE' "$folder/said" || fail "it does not say why"

[ "$library" ] || exit 0
"${CC:-cc}" "$source/tests/install/user.c" -o "$folder/two-odes" -I"$source/space/include" -I"$prefix/include" \
  "$prefix/lib/libode.a" -Wl,--exclude-libs,ALL "$library" -Wl,-rpath,"$(dirname "$library")" -lstdc++ -lm
! "$folder/two-odes" >"$folder/said" 2>&1 || fail "a program with two ODEs runs"
grep -q 'an ODE of its own .* in dParallelSAPSpaceCreate()' "$folder/said" || fail "it does not say why"
