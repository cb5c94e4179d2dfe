#!/usr/bin/env bash
# package.sh SOURCE BUILD
#
# Makes the Debian packages, the source archive and the Debian source package of a build for the prefix
# /usr. Looks at what they depend on and what they hold, has lintian look if it is installed, and builds
# and runs user.c against the unpacked packages. Ends with status 77 where there are no Debian tools.
. "$(dirname "$0")/../support/script.sh"
source=$1 build=$2 here=$(cd "$(dirname "$0")" && pwd)
for tool in dpkg-deb dpkg-shlibdeps file; do
  command -v $tool >/dev/null || skip "no dpkg-deb, dpkg-shlibdeps or file (Debian: dpkg-dev file)"
done
lint() {
  command -v lintian >/dev/null || { echo "without lintian" && return; }
  lintian --allow-root --fail-on error,warning "$@" || fail "lintian objects"
}

cd "$folder"
quietly cpack --config "$build/CPackConfig.cmake"
! grep -qi warning "$folder/said" || fail "CPack warns"
[ "$(ls ./*.deb | wc -l)" -eq 3 ] || fail "not three packages: $(ls)"
dpkg-deb -I libode-parallel-sap0_*.deb shlibs | grep -q '^libode-parallel-sap 0 libode-parallel-sap0 (= ' ||
  fail "programs that link the library would not depend on its package"
depends() { dpkg-deb -f ./"$1"_*.deb Depends; }
depends libode-parallel-sap0 | grep -q 'libode8[a-z0-9]* (>= 2:0.16' || fail "the library does not depend on ODE"
depends libode-parallel-sap0 | grep -q 'libode8[a-z0-9]* (<< 2:0.17~)' || fail "the library takes a later ODE for good"
depends libode-parallel-sap-dev | grep -q 'libode-dev' || fail "the header comes without ODE's"
depends ode-parallel-sap-preload | grep -q 'libode-parallel-sap0 (= ' || fail "the preload library comes alone"
for package in *.deb; do dpkg-deb -x "$package" root; done
lint ./*.deb
for package in *.deb; do
  maintainer=$(dpkg-deb -f "$package" Maintainer)
  [ "$maintainer" = "$DEBFULLNAME <$DEBEMAIL>" ] || fail "$package is $maintainer's"
done

libdir=$(dirname "$(find "$folder/root" -name pkgconfig)")
eval "flags=($(PKG_CONFIG_PATH=$libdir/pkgconfig pkg-config --cflags --libs ode-parallel-sap))"
"${CC:-cc}" "$here/user.c" -o user-program "${flags[@]}"
LD_LIBRARY_PATH=$libdir ./user-program
[ -z "$(readelf -d "$libdir"/*.so | grep -E 'RPATH|RUNPATH')" ] || fail "a search path is left in a library"

# The source archive is what is in the repository.
quietly cpack --config "$build/CPackSourceConfig.cmake"
tar xf ./*.tar.gz
name=$(ls -d ode-parallel-sap-*/)
(cd "$name" && find . -type f -o -type l | sed 's|^\./||' | sort) >packed
grep -qx "space/include/ode_parallel_sap/parallel_sap_space.h" packed || fail "the source archive has no header"
if git -C "$source" rev-parse --is-inside-work-tree >/dev/null 2>&1; then
  git -C "$source" ls-files --cached --others --exclude-standard | sort | diff - packed ||
    fail "the source archive (>) is not what the repository holds (<)"
fi

# The Debian source package is that archive, ODE's private headers and what makes the same packages of it.
quietly cmake --build "$build" --target debian-source
quietly dpkg-source -x "$build"/debian-source/*.dsc tree
(cd tree && find . \( -path ./debian -o -path ./ode -o -path ./.pc \) -prune -o \( -type f -o -type l \) -print | sed 's|^\./||' | sort) |
  diff packed - || fail "the Debian source package (>) is not the source archive (<)"
[ -e tree/ode/ode/src/collision_kernel.h ] || fail "the Debian source package has no private headers"
diff <(sed -n 's/^Package: //p' tree/debian/control | sort) <(for each in *.deb; do dpkg-deb -f "$each" Package; done | sort) ||
  fail "the Debian source package makes (<) other packages than cpack (>)"
lint "$build"/debian-source/*.dsc
