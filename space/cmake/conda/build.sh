#!/usr/bin/env bash
# What rattler-build runs in the source tree, with conda's compilers and libode in PREFIX and ODE's source in ode/.
set -euo pipefail
# shellcheck disable=SC2086 # CMAKE_ARGS are words
cmake ${CMAKE_ARGS-} -S . -B build-conda -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" \
  -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=ON -DBUILD_TESTING=OFF -DODE_PARALLEL_SAP_EXAMPLES=OFF \
  -DODE_PARALLEL_SAP_CUDA=OFF -DODE_PARALLEL_SAP_ODE=SYSTEM -DODE_SOURCE_DIR="$PWD/ode"
cmake --build build-conda --parallel "${CPU_COUNT:-1}"
cmake --install build-conda
