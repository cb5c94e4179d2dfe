#!/usr/bin/env bash
# make_source.sh VERSION ARCHIVE DEBIAN ODE FOLDER
#
# Makes the Debian source package of VERSION in FOLDER: of the source archive that cpack makes from the
# configuration ARCHIVE, of the directory DEBIAN as its debian/, and, as a second archive that is unpacked to
# ode/, of the private headers in ODE's source tree, so that nothing is fetched while it is built.
set -euo pipefail
version=$1 archive=$2 debian=$3 ode=$4 folder=$5
name=ode-parallel-sap
tree=$name-$version
private=$(mktemp -d)
trap 'rm -rf "$private"' EXIT
run() { "$@" >"$private/log" 2>&1 || { cat "$private/log" >&2; exit 1; }; }

cd "$private"
run cpack --config "$archive"
mv "$tree.tar.gz" "${name}_$version.orig.tar.gz"
(cd "$ode" && tar c --sort=name --mtime=@0 --owner=root:0 --group=root:0 --transform 's|^|ode/|' \
  configure.ac LICENSE* ode/src/*.h ou/include) | gzip -9n >"${name}_$version.orig-ode.tar.gz"
tar xf "${name}_$version.orig.tar.gz"
tar xf "${name}_$version.orig-ode.tar.gz" -C "$tree"
cp -a "$debian" "$tree/debian"
run dpkg-source --build "$tree"
mkdir -p "$folder"
rm -f "$folder/${name}_$version"*
mv "${name}_$version"*.dsc "${name}_$version"*.tar.* "$folder/"
ls "$folder"/*.dsc
