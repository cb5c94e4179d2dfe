#!/usr/bin/env bash
# lookalike.sh larger|smaller ODE FOLDER
#
# Makes of the source of ODE 0.16.2 a fork of it, in FOLDER, that says it is version 0.13.1. larger: dxGeom has
# fields more, and all behind them lies elsewhere, as in Webots' fork (200 bytes). smaller: it has none of the
# fields next_ex and tome_ex, as in Gazebo classic's (144 bytes); the stock spaces that use them have
# them in a table of their own. Its spaces have a mutex, and lengths up to 1e-6 are zero.
set -euo pipefail
kind=$1 ode=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder"
(cd "$ode" && tar c --exclude=.git --exclude=build .) | tar x -C "$folder"
cd "$folder"

sed -i 's/dODE_VERSION "0\.16\.[0-9]*"/dODE_VERSION "0.13.1"/' include/ode/version.h*
sed -i 's/set(VERSION_MINOR 16)/set(VERSION_MINOR 13)/; s/set(VERSION_PATCH [0-9]*)/set(VERSION_PATCH 1)/' CMakeLists.txt
kernel=ode/src/collision_kernel
case $kind in
larger)
  sed -i '/^struct dxGeom/,/^};/ {
    s/^ *int gflags;.*/&\n    void *fork_handles[2];/
    s/^ *dxGeom \*body_next;.*/&\n    double fork_numbers[3];/
  }' $kernel.h
  [ "$(grep -c 'fork_' $kernel.h)" -eq 2 ]
  ;;
smaller)
  sed -i '/^ *dxGeom \*next_ex;/d; /^ *dxGeom \*\*tome_ex;/d' $kernel.h
  sed -i '/^struct dxGeom/i struct fork_links { dxGeom *next_ex; dxGeom **tome_ex; };\nfork_links \&forkLinksOf(const dxGeom *geom);\n' $kernel.h
  sed -i 's/^ *next_ex = 0;/    forkLinksOf(this) = fork_links();/; /^ *tome_ex = 0;/d' $kernel.cpp
  cat >>$kernel.cpp <<'CPP'

#include <map>
fork_links &forkLinksOf(const dxGeom *geom)
{
    static std::map<const dxGeom *, fork_links> &all = *new std::map<const dxGeom *, fork_links>;
    return all[geom];
}
CPP
  sed -Ei 's/(\([a-z]\)|[A-Za-z_0-9]+)->(next_ex|tome_ex)/forkLinksOf(\1).\2/g' ode/src/collision_sapspace.cpp \
    ode/src/collision_quadtreespace.cpp
  ! grep -n 'next_ex\|tome_ex' $kernel.h | grep -v fork_links
  sed -i 's/^ *unsigned tls_kind;.*/&\n    std::mutex fork_mutex;/; 0,/^#include/s//#include <mutex>\n&/' $kernel.h
  sed -Ei '/updateZeroSizedFlag/ s/!([a-z_]+)/\1 <= 1e-6/g' ode/src/{box,sphere,capsule,cylinder}.cpp
  ;;
*)
  echo "$kind is neither larger nor smaller"
  exit 1
  ;;
esac
