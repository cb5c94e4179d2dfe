#!/usr/bin/env bash
# headers.sh larger|smaller FOLDER PREFIX
#
# Gives the headers of a lookalike that is built (lookalike.sh, in FOLDER, installed to PREFIX) what the
# forks' have otherwise and no compiled library shows.
set -euo pipefail
kind=$1 sources=$2/ode/src public=$3/include

# Both forks.
sed -i '/dCreateConvex/,/;/ s/const //' "$public/ode/collision.h"
sed -i '/dGeomTriMeshDataPreprocess2/d' "$public/ode/collision_trimesh.h"
sed -i '/^#define CHECK_NOT_LOCKED/,/^$/d; /^ *CHECK_NOT_LOCKED/d' "$sources/collision_kernel.h"
cat >>"$sources/collision_space_internal.h" <<'H'
#define CHECK_NOT_LOCKED(space) dUASSERT(!(space) || (space)->lock_count == 0, "Invalid operation for locked space")
H
[ "$kind" = smaller ] || exit 0

# Gazebo classic's: <gazebo/ode/ode.h>, no version.h, no setters of single flags of rays; operators for all types
# in ou; private headers that need a config.h of their own build and a folder of other sources.
rm -rf "$public/gazebo" "$public/ode/version.h"
mkdir "$public/gazebo"
mv "$public/ode" "$public/gazebo/ode"
sed -i '/<ode\/\(version\|odecpp.*\)\.h>/d; s/<ode\//<gazebo\/ode\//' "$public"/gazebo/ode/*.h
sed -i '/define dNaN/d' "$public/gazebo/ode/odeconfig.h"
sed -i '/dGeomRay[GS]et\(FirstContact\|BackfaceCull\)/d' "$public/gazebo/ode/collision.h"
sed -i '/^class COdeOu/i using namespace _OU_NAMESPACE;' "$sources/odeou.h"
mkdir -p "$2/deps/threadpool" "$2/made"
echo 'struct fork_pool;' >"$2/deps/threadpool/threadpool.hpp"
sed -i '0,/^#include/s//#include <threadpool.hpp>\n&/' "$sources/objects.h"
sed -i '0,/^struct dxGeom/s//typedef fork_word fork_words[1];\n&/' "$sources/collision_kernel.h"
cat >"$2/made/config.h" <<'H'
#define dOU_ENABLED 1
#define dATOMICS_ENABLED 1
#define dTLS_ENABLED 1
#define _OU_NAMESPACE odeou
#define _OU_FEATURE_SET _OU_FEATURE_SET_TLS
#define _OU_TARGET_OS _OU_TARGET_OS_GENUNIX
#include <stdint.h>
#include <stdlib.h>
#include "typedefs.h"
typedef uintptr_t fork_word;
H
