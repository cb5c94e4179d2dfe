#!/usr/bin/env bash
# clean_chroot.sh build|use SOURCE_PACKAGE FOLDER
#
# build: builds a Debian source package (the folder in which its .dsc is) in a minimal Debian, without network once the
# packages it names are installed, and has lintian look at what was built, if it is there. use: runs the source
# package's own test with the built packages in another minimal Debian. Needs root and debootstrap, and an archive that
# apt knows; ends with status 77 where it lacks one. The minimal Debian is made in FOLDER and kept for the next time.
. "$(dirname "$0")/../support/script.sh"
stage=$1 package=$2 kept=$3
[ "$(id -u)" = 0 ] || skip "only root can make a minimal Debian"
command -v debootstrap >/dev/null || skip "no debootstrap (Debian: debootstrap)"
unshare --mount --net true 2>/dev/null || skip "no namespaces for a chroot without network"
[ -e "$(echo "$package"/*.dsc)" ] || skip "no source package in $package"
suite=$(. /etc/os-release && echo "${VERSION_CODENAME-}")
archive=$(apt-get indextargets --format '$(REPO_URI) $(SUITE) $(CODENAME)' 2>/dev/null |
  awk -v suite="$suite" '$2 == suite || $3 == suite { print $1; exit }')
[ "$archive" ] || skip "apt knows no archive of $suite (apt-get update)"

mkdir -p "$kept"
kept=$(cd "$kept" && pwd)
base=$kept/$suite root=$kept/root made=$kept/made said=$folder/said
if [ ! -e "$base/complete" ]; then
  rm -rf "$base"
  debootstrap --variant=minbase "$suite" "$base" "$archive" >"$said" 2>&1 || { tail "$said"; skip "debootstrap failed"; }
  touch "$base/complete"
fi
rm -rf "$root"
cp -a "$base" "$root"
trap 'rm -rf "$folder" "$root"' EXIT
cp /etc/resolv.conf "$root/etc/resolv.conf"
mkdir "$root/srv/made"

# inside NETWORK COMMAND: in the chroot; NETWORK is all or none. What is mounted for it goes with it.
inside() {
  local alone=(--mount)
  [ "$1" != none ] || alone+=(--net)
  unshare "${alone[@]}" sh -ec 'mount -t proc proc "$0/proc"; mkdir -p "$0/dev/shm"; mount -t tmpfs tmpfs "$0/dev/shm"
    exec chroot "$0" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
      sh -ec "cd /srv/made; $1"' "$root" "$2" >"$said" 2>&1 || fail "failed in a clean chroot: $2"
}
install="apt-get -q update; apt-get -qy --no-install-recommends"

case $stage in
  build)
    cp "$package"/*.dsc "$package"/*.tar.* "$root/srv/made"
    inside all "$install install build-essential fakeroot; apt-get -qy --no-install-recommends build-dep ./*.dsc"
    inside none "dpkg-source -x *.dsc tree; cd tree
      DEB_BUILD_OPTIONS=parallel=$(nproc) dpkg-buildpackage --unsigned-source --unsigned-changes --build=full"
    rm -rf "$made"
    mv "$root/srv/made" "$made"
    command -v lintian >/dev/null || { echo "without lintian"; exit; }
    lintian --allow-root --fail-on error,warning "$made"/*.changes || fail "lintian objects"
    ;;
  use)
    cp -a "$made"/*.deb "$made/tree" "$root/srv/made"
    tested=$(sed -n 's/^Depends: @, //p' "$made/tree/debian/tests/control" | tr -d ,)
    inside all "rm -f *-dbgsym_*.deb; $install install ./*.deb $tested"
    inside none 'cd tree; debian/tests/use'
    [ "$(grep -c ': works$' "$said")" -eq 3 ] || fail "not three ways to use the packages"
    cat "$said"
    ;;
esac
