#!/bin/sh
# Downloads the upstream tarball of ODE from the Debian archive into a directory:
#
#     fetch_debian_source.sh VERSION DIRECTORY        # 0.16.2 /some/directory
#
# Works for root and for any other user, and changes nothing of the system's apt: the deb-src
# entries are derived from the machine's own sources into a temporary directory, which is also where
# the package lists go. apt checks the signatures. Exit status 0: DIRECTORY/*.orig.tar.* is there.
set -eu
version=$1
directory=$2

say() { echo "ode source: $*" >&2; }

for tool in apt-get apt-config dpkg-query; do
  command -v "$tool" >/dev/null || { say "no $tool: not a Debian system"; exit 1; }
done

# Readable by all: apt, run by root, downloads as the user _apt.
private=$(mktemp -d)
trap 'rm -rf "$private"' EXIT
trap 'exit 1' HUP INT TERM
chmod 755 "$private"
mkdir -m 755 "$private/sources" "$private/state" "$private/state/lists" "$private/cache" "$private/download"
[ "$(id -u)" != 0 ] || chown _apt "$private/download" 2>/dev/null || true

list='' parts=''
eval "$(apt-config shell list Dir::Etc::sourcelist/f parts Dir::Etc::sourceparts/d)"

# One-line format: each "deb" entry again as "deb-src".
for file in "$list" "$parts"/*.list; do
  [ -r "$file" ] || continue
  sed -n 's/^[[:space:]]*deb\(-src\)\{0,1\}[[:space:]]\{1,\}/deb-src /p' "$file" |
    grep -v '^deb-src \(\[[^]]*\] *\)\{0,1\}cdrom:' |
    sort -u >"$private/sources/$(basename "$file" .list).list" || true
done

# deb822 format: each stanza with its type replaced.
for file in "$parts"/*.sources; do
  [ -r "$file" ] || continue
  sed 's/^[Tt][Yy][Pp][Ee][Ss]:.*/Types: deb-src/' "$file" >"$private/sources/$(basename "$file")"
done

# A file given by -c is read after the system's settings, so it can take the hooks out of them.
cat >"$private/apt.conf" <<EOF
#clear APT::Update::Pre-Invoke;
#clear APT::Update::Post-Invoke;
#clear APT::Update::Post-Invoke-Success;
Dir::Etc::sourcelist "/dev/null";
Dir::Etc::sourceparts "$private/sources";
Dir::State "$private/state";
Dir::State::lists "$private/state/lists";
Dir::State::status "$(apt-config shell status Dir::State::status/f | sed "s/^status='\(.*\)'$/\1/")";
Dir::Cache "$private/cache";
Acquire::Languages "none";
Acquire::Retries "2";
Acquire::http::Timeout "30";
Acquire::https::Timeout "30";
EOF

# Runs apt-get with these settings. Entries that two of the machine's files have in common are no
# concern of the user's here.
run_apt() {
  status=0
  LC_ALL=C apt-get -c "$private/apt.conf" -qq "$@" >"$private/log" 2>&1 || status=$?
  grep -v 'is configured multiple times' "$private/log" >&2 || true
  return $status
}

# A repository without source packages makes the update fail; ODE's may be among the others.
run_apt update || say "some package lists could not be had; going on with the rest"
set -- "$private/state/lists/"*_Sources*
[ -e "$1" ] || { say "no list of source packages could be had from this machine's archives"; exit 1; }

# The source of the package that is installed; else any with the same upstream version. Why one cannot be
# had is of interest where neither can.
package=$(dpkg-query -W -f '${source:Version}' libode-dev 2>/dev/null || true)
cd "$private/download"
for wanted in ${package:+ode="$package"} ode; do
  run_apt source --download-only --tar-only "$wanted" 2>>"$private/errors" || continue
  for tarball in "ode_$version"*.orig.tar.*; do
    case $tarball in *.asc | *'*'*) continue ;; esac
    mkdir -p "$directory"
    cp "$tarball" "$directory/"
    exit 0
  done
  say "the archive has $(echo ode_*.orig.tar.*), not version $version"
done
cat "$private/errors" >&2
exit 1
