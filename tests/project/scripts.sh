#!/usr/bin/env bash
# scripts.sh SOURCE
#
# The scripts named `run` on a machine that is made up: what they install, what they say to a user who cannot, and
# which arguments go where. Nothing is installed or built.
. "$(dirname "$0")/../support/script.sh"
source=$1

# The tree: the scripts, and a `pile` that prints its arguments.
mkdir -p "$folder/tree/build/release/examples/pile" "$folder/bin"
scripts="examples/run tests/run examples/tradeoff/run cuda/check/run tests/bench/run"
for file in space/cmake/install_packages.sh $scripts examples/pile/options.cpp cuda/check/check.cpp; do
  mkdir -p "$(dirname "$folder/tree/$file")"
  cp "$source/$file" "$folder/tree/$file"
done
cp "$source/examples/tradeoff/"*.py "$folder/tree/examples/tradeoff"
stub() { # stub FILE COMMANDS
  [ ! -e "$1" ] || fail "$1 is there already"
  printf '#!/bin/bash\n%s\n' "$2" >"$1" && chmod +x "$1"
}
stub "$folder/tree/build/release/examples/pile/pile" 'echo "pile: $*"'

# The machine: only these commands. A package is installed if it has a file in installed/, and to be had
# if it is not named in $UNKNOWN.
for name in bash dirname grep sed touch env; do stub "$folder/bin/$name" "exec '$(command -v $name)' \"\$@\""; done
mkdir "$folder/installed"
export INSTALLED=$folder/installed USER_ID=0 UNKNOWN=
stub "$folder/bin/id" 'echo $USER_ID'
stub "$folder/bin/nproc" 'echo 2'
stub "$folder/bin/sleep" ''
stub "$folder/bin/cmake" 'touch "$INSTALLED/began"; echo "cmake: $*"'
stub "$folder/bin/ctest" 'echo "ctest: $*"'
stub "$folder/bin/pkg-config" '[ -e "$INSTALLED/libode-dev" ]'
stub "$folder/bin/dpkg-query" '[ -e "$INSTALLED/${!#}" ] && echo installed'
stub "$folder/bin/apt-cache" '[[ " $UNKNOWN " != *" $2 "* ]]'
stub "$folder/bin/apt-get" '
touch "$INSTALLED/began"
[ "$USER_ID" = 0 ] || exit 1
[ "$1" = install ] || exit 0
[[ " $* " == *" -qq "* ]] || echo "The following NEW packages will be installed:"
for word in "$@"; do
  [[ " $UNKNOWN " != *" $word "* ]] || { echo "E: Unable to locate package $word" >&2; exit 100; }
done
for word in "${@:2}"; do [[ $word == -* ]] || touch "$INSTALLED/$word"; done'
for name in c++ make; do stub "$folder/bin/$name" ''; done
run() { # run STATUS SCRIPT ARGUMENT...: which must end with this status
  local status=0
  PATH=$folder/bin "$folder/tree/$2" "${@:3}" >"$folder/said" 2>"$folder/errors" || status=$?
  [ $status -eq "$1" ] || fail "${*:2} ends with $status: $(cat "$folder/errors")"
}
complains() { grep -q -e "$1" "$folder/errors" || fail "no '$1': $(cat "$folder/errors")"; }
says() { grep -qxF -- "$1" "$folder/said" || fail "does not say '$1': $(cat "$folder/said" "$folder/errors")"; }

# Help and wrong arguments come before anything is installed or configured.
for script in $scripts; do
  run 0 "$script" --help
  grep -q "$script" "$folder/said" || fail "not in its help: $script"
  run 2 "$script" --bad
  complains --bad
done
for arguments in "examples/run --scene balls --colour=red" "examples/run balls" "examples/run -x" "tests/run pairs" \
  "tests/run -R" "tests/run -LE cpu" "examples/tradeoff/run quick" "examples/tradeoff/run --scene Tower pack" \
  "examples/tradeoff/run --budget 9 -x" "cuda/check/run everything" "tests/bench/run bad" "tests/bench/run pack"; do
  # shellcheck disable=SC2086 # they are words
  run 2 $arguments
done
[ ! -e "$folder/installed/began" ] || fail "something was installed or configured before the answer"
if command -v python3 >/dev/null; then
  # Scripts that have nothing to show, or nothing to show it with, end with one line and an error.
  echo "raise ImportError('none here')" >"$folder/matplotlib.py"
  for script in "bench/table.py /nonexistent" "bench/plot.py /nonexistent"; do
    # shellcheck disable=SC2086 # they are words
    ! PYTHONPATH=$folder PYTHONDONTWRITEBYTECODE=1 python3 "$source/tests/"$script >"$folder/said" 2>&1 || fail "$script ends with 0"
    [ "$(wc -l <"$folder/said")" -eq 1 ] || fail "$script: $(cat "$folder/said")"
  done
fi

# With --no-install a missing package that is needed ends a script.
for script in examples/run tests/run examples/tradeoff/run tests/bench/run; do
  run 1 "$script" --no-install
  complains 'because of --no-install.* libode-dev'
done
[ ! -e "$folder/installed/began" ] || fail "--no-install installs"

# A user who can install nothing is told all of it in one line, and nothing is begun.
for script in examples/run tests/run; do
  USER_ID=1000 run 1 $script
  [ "$(wc -l <"$folder/errors")" -eq 1 ] || fail "not one line: $(cat "$folder/errors")"
  grep -q 'on two cores' "$folder/said" || fail "$script does not say how long it takes"
  complains 'As root: apt-get install .*libode-dev libcli11-dev'
done
complains 'libcli11-dev catch2 .*git .* valgrind$'

# One package that the archive lacks does not keep the others away.
UNKNOWN=python3-pyode run 0 tests/run
[ -e "$folder/installed/valgrind" ] && [ -e "$folder/installed/git" ] || fail "only $(ls "$folder/installed")"
complains 'Going on without python3-pyode$'
grep -q 'NEW packages' "$folder/said" || fail "what is installed is not listed first"

# On a Debian with nothing, tests/run brings at most 60 packages besides those that the build needs.
count_packages() { # count_packages PACKAGE...
  apt-get -s -o Dir::State::status=/dev/null install --no-install-recommends "$@" 2>/dev/null | grep -c '^Inst '
}
building=(g++ make cmake pkg-config libode-dev libcli11-dev catch2)
run 0 tests/run
if command -v apt-get >/dev/null && needed=$(count_packages "${building[@]}"); then
  mapfile -t asked < <(ls -I began "$folder/installed" | while read -r name; do ! apt-cache show "$name" >&/dev/null || echo "$name"; done)
  [ ${#asked[@]} -gt 5 ] || fail "only ${asked[*]} are to be had"
  more=$(($(count_packages "${building[@]}" "${asked[@]}") - needed))
  [ $more -gt 0 ] && [ $more -le 60 ] || fail "tests/run installs $more packages that the build does not need"
else
  echo "Packages not counted: no lists of apt's"
fi

# What only the tests that build the project again need is installed for these alone; --no-install does without.
[ ! -e "$folder/installed/qemu-user" ] || fail "tests/run installs what it does not use"
# Tests on other systems cannot be built with Catch2 3, so nothing is installed for them there.
catch2_2=
[ ! -e /usr/include/catch2/catch.hpp ] || catch2_2=1
run 0 tests/run --all --no-install
complains 'Going on without .*dpkg-dev'
[ ! -e "$folder/installed/dpkg-dev" ] || fail "--no-install installs"
[ "$(grep -c 'Going on without .*qemu-user' "$folder/errors")" -eq "${catch2_2:-0}" ] || fail "$(cat "$folder/errors")"
run 0 tests/run --all
[ -e "$folder/installed/dpkg-dev" ] || fail "only $(ls "$folder/installed")"
[ "${catch2_2:-0}" = "$([ -e "$folder/installed/qemu-user" ] && echo 1 || echo 0)" ] || fail "only $(ls "$folder/installed")"
says "ctest: --test-dir build/release --parallel 2 --output-on-failure --no-tests=error"

# Settings go to CMake, what follows to the program.
run 0 examples/run -DODE_SOURCE_DIR=/some/where -DA=b --scene balls
says "cmake: --preset release -DBUILD_TESTING=OFF -DODE_SOURCE_DIR=/some/where -DA=b"
says "cmake: --build build/release --target pile ode-parallel-sap-libraries --parallel 2"
says "pile: --scene balls --snapshot build/release/pile.png --if-possible"
run 0 examples/run -DA=b
says "pile: --scene cubes --compare 10 --snapshot build/release/pile.png --if-possible"

# A picture that is asked for is the only one; what draws it is then needed, otherwise wanted.
for arguments in "--view" "--snapshot a.png" "--help"; do
  # shellcheck disable=SC2086 # they are words
  run 0 examples/run $arguments
  says "pile: $arguments"
done
rm "$folder/installed/libgl1-mesa-dri" "$folder/installed/libpng-dev"
UNKNOWN=libgl1-mesa-dri run 0 examples/run
complains 'Going on without libgl1-mesa-dri$'
[ -e "$folder/installed/libpng-dev" ] || fail "only $(ls "$folder/installed")"
says "pile: --scene cubes --compare 10 --snapshot build/release/pile.png --if-possible"
UNKNOWN=libgl1-mesa-dri run 1 examples/run --snapshot a.png # which cannot be done without
run 0 examples/run
run 0 tests/run -DODE_SOURCE_DIR=/some/where -R pairs
says "cmake: --preset release -DODE_SOURCE_DIR=/some/where"
says "ctest: --test-dir build/release --parallel $(nproc) --output-on-failure --no-tests=error -R pairs -LE ^rebuild\$"
