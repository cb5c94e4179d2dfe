# Sourced by the scripts named `run`, from the top of the source tree: their help, their options, and the packages that
# are missing on a Debian system.

# print_help SCRIPT: the comment that the script begins with.
print_help() { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$1"; }

# say_times SCRIPT: the lines of its help with its run times.
say_times() { print_help "$1" | grep 'on two cores'; }

# reject SCRIPT WORD: ends the script because of a wrong argument.
reject() {
  echo "$1: unknown argument $2. Try $1 --help." >&2
  exit 2
}

# check_option SCRIPT WORD SOURCE: ends the script unless SOURCE, which parses the options, contains this one.
check_option() { grep -qF "\"${2%%=*}\"" "$3" || reject "$1" "$2"; }

# Set by --no-install: nothing is installed.
no_install=

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
    [[ " ${missing[*]} " == *" $package "* ]] || is_there "$package" || missing+=("$package")
  done
}

# Sets `known` to those of the given packages that the archive has: the rest would fail with any other.
find_known() {
  known=()
  local package
  for package in "$@"; do
    ! apt-cache show "$package" >/dev/null 2>&1 || known+=("$package")
  done
}

# What a script is to `want` after what it needs: who has to install by hand is told all in one line.
wanted=()

# Installs what is `missing`. Fails, with a line that says what to do, if some of it then still is.
install_missing() {
  local asked=("${missing[@]}") as_root=() attempt
  if [ "$no_install" ]; then
    find_missing "${asked[@]}" "${wanted[@]}"
    echo "Missing, and not installed because of --no-install. As root: apt-get install ${missing[*]}" >&2
    return 1
  fi
  if ! command -v apt-get >/dev/null; then
    echo "Needed, by their names in Debian: ${missing[*]}. Not looked for any further here: no apt-get." >&2
    return 0
  fi
  if [ "$(id -u)" -ne 0 ]; then
    as_root=(sudo)
    if ! command -v sudo >/dev/null; then
      find_missing "${asked[@]}" "${wanted[@]}"
      echo "Missing, and no sudo to install it with. As root: apt-get install ${missing[*]}" >&2
      return 1
    fi
  fi
  echo "Installing ${asked[*]}"
  for attempt in 1 2; do
    [ "$attempt" -eq 1 ] || sleep 5
    "${as_root[@]}" apt-get update -qq || true # one source that is down need not matter
    find_known "${asked[@]}"
    # Not -qq: apt-get lists all that it will install, and its size, before it begins.
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${known[@]}" \
      </dev/null && [ ${#known[@]} -eq ${#asked[@]} ] && break
  done
  find_missing "${asked[@]}"
  [ ${#missing[@]} -gt 0 ] || return 0
  echo "Could not be installed (see above). As root: apt-get install ${missing[*]}" >&2
  return 1
}

# need PACKAGE...: returns when all of them are there; ends the script where that cannot be reached.
need() {
  find_missing "$@"
  [ ${#missing[@]} -eq 0 ] || install_missing || exit 1
}

# want: the same for those in `wanted`; but what cannot be installed is done without.
want() {
  find_missing "${wanted[@]}"
  [ ${#missing[@]} -eq 0 ] || install_missing || echo "Going on without ${missing[*]}" >&2
}
