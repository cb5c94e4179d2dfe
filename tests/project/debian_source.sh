#!/usr/bin/env bash
# debian_source.sh FETCH
#
# FETCH (fetch_debian_source.sh) with an archive of this test's own: what it says where the archive is
# down, and where two of the machine's files name it. Ends with status 77 where there is no apt.
. "$(dirname "$0")/../support/script.sh"
fetch=$1
command -v apt-get >/dev/null && command -v dpkg-query >/dev/null || skip "no apt-get, this is not a Debian system"
chmod 755 "$folder"

# A machine whose apt has these sources and no others.
mkdir -p "$folder/sources" "$folder/archive"
cat >"$folder/apt.conf" <<END
Dir::Etc::sourcelist "/dev/null";
Dir::Etc::sourceparts "$folder/sources";
END
export APT_CONFIG=$folder/apt.conf
fetch() { sh "$fetch" 0.16.99 "$folder/got" >"$folder/said" 2>&1; }

echo "deb [trusted=yes] file:$folder/archive-that-is-down ./" >"$folder/sources/a.list"
! fetch || fail "a source without an archive"
! grep -q 'deb-src' "$folder/said" || fail "the user is told to add what the script adds by itself"
grep -q 'no list of source packages' "$folder/said" || fail "it does not say what is wrong"

# An archive with one source package, which two files name.
cd "$folder/archive"
echo "the source" | gzip -n >ode_0.16.99.orig.tar.gz
printf 'Package: ode\nBinary: libode-dev\nVersion: 2:0.16.99-1\nMaintainer: A <a@localhost>\nFormat: 3.0 (quilt)\nDirectory: .\n' >Sources
printf 'Checksums-Sha256:\n %s %s %s\n' "$(sha256sum ode_*.gz | cut -d' ' -f1)" "$(stat -c %s ode_*.gz)" ode_*.gz >>Sources
: >Packages
echo "deb [trusted=yes] file:$folder/archive ./" >"$folder/sources/a.list"
echo "deb-src [trusted=yes] file:$folder/archive ./" >"$folder/sources/b.list"
fetch || fail "nothing from an archive that is there"
cmp ode_0.16.99.orig.tar.gz "$folder/got/ode_0.16.99.orig.tar.gz" || fail "not the source"
[ ! -s "$folder/said" ] || fail "the user is told of what is no concern of his"
