# Sourced by examples/run and tests/run: installs the packages that are missing on a Debian system.

# Whether what a Debian package is needed for is there, wherever it came from.
is_there() {
  case $1 in
    g++) command -v "${CXX:-c++}" ;;
    make) [ -n "${CMAKE_GENERATOR:-}" ] || command -v make ;;
    cmake | pkg-config) command -v "$1" ;;
    libode-dev) command -v pkg-config && pkg-config --exists ode ;;
    *) command -v dpkg-query && dpkg-query -W -f '${db:Status-Status}' "$1" | grep -qx installed ;;
  esac >/dev/null 2>&1
}

# Sets `missing` to those of the given packages that are not there.
find_missing() {
  missing=()
  local package
  for package in "$@"; do
    is_there "$package" || missing+=("$package")
  done
}

# want PACKAGE...: like need, but what cannot be installed is done without.
want() {
  (need "$@") || echo "Going on without ${*}" >&2
}

# need PACKAGE...: returns when all of them are there; ends the script where that cannot be reached.
need() {
  find_missing "$@"
  [ ${#missing[@]} -gt 0 ] || return 0
  if ! command -v apt-get >/dev/null; then
    echo "Needed, by their names in Debian: ${missing[*]}. Not looked for any further here: no apt-get." >&2
    return 0
  fi

  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "Missing: ${missing[*]}. As root: apt-get install ${missing[*]}" >&2
      exit 1
    fi
    as_root=(sudo)
  fi
  echo "Installing ${missing[*]}"
  local install=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends)
  local attempt
  for attempt in 1 2; do
    [ "$attempt" -eq 1 ] || sleep 5
    "${as_root[@]}" apt-get update -qq || true # one source that is down need not matter
    "${install[@]}" "${missing[@]}" </dev/null && break
  done
  find_missing "$@"
  if [ ${#missing[@]} -gt 0 ]; then
    echo "Could not be installed: ${missing[*]} (see above)" >&2
    exit 1
  fi
}
