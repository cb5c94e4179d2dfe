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
run() { # run SCRIPT ARGUMENT...
  status=0
  PATH=$folder/bin "$folder/tree/$1" "${@:2}" >"$folder/said" 2>"$folder/errors" || status=$?
}
says() { grep -qxF -- "$1" "$folder/said" || fail "does not say '$1': $(cat "$folder/said" "$folder/errors")"; }

# Help and wrong arguments come before anything is installed or configured.
for script in $scripts; do
  run "$script" --help
  [ $status -eq 0 ] && grep -q "$script" "$folder/said" || fail "$script --help: $(cat "$folder/said" "$folder/errors")"
  run "$script" --bad
  [ $status -eq 2 ] && grep -q -e --bad "$folder/errors" || fail "$script --bad ends with $status: $(cat "$folder/errors")"
done
for arguments in "examples/run --scene balls --colour=red" "examples/run balls" "examples/run -x" "tests/run pairs" \
  "tests/run -R" "tests/run -LE cpu" "examples/tradeoff/run quick" "examples/tradeoff/run --scene Tower pack" \
  "examples/tradeoff/run --budget 9 -x" "cuda/check/run everything" "tests/bench/run bad" "tests/bench/run pack"; do
  # shellcheck disable=SC2086 # they are words
  run $arguments
  [ $status -eq 2 ] || fail "$arguments ends with $status: $(cat "$folder/said" "$folder/errors")"
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
  run "$script" --no-install
  [ $status -eq 1 ] && grep -q 'because of --no-install.* libode-dev' "$folder/errors" || fail "$script: $(cat "$folder/errors")"
done
[ ! -e "$folder/installed/began" ] || fail "--no-install installs"

# A user who can install nothing is told all of it in one line, and nothing is begun.
for script in examples/run tests/run; do
  USER_ID=1000 run $script
  [ $status -eq 1 ] || fail "$script ends with $status where a package is missing"
  [ "$(wc -l <"$folder/errors")" -eq 1 ] || fail "not one line: $(cat "$folder/errors")"
  grep -q 'on two cores' "$folder/said" || fail "$script does not say how long it takes"
  grep -q 'As root: apt-get install .*libode-dev libcli11-dev' "$folder/errors" || fail "$(cat "$folder/errors")"
done
grep -q 'libcli11-dev catch2 .*git .* valgrind$' "$folder/errors" || fail "tests/run does not name what it wants"

# One package that the archive lacks does not keep the others away.
UNKNOWN=python3-pyode run tests/run
[ $status -eq 0 ] || fail "tests/run ends with $status: $(cat "$folder/errors")"
[ -e "$folder/installed/valgrind" ] && [ -e "$folder/installed/git" ] || fail "only $(ls "$folder/installed")"
grep -q 'Going on without python3-pyode$' "$folder/errors" || fail "$(cat "$folder/errors")"
grep -q 'NEW packages' "$folder/said" || fail "what is installed is not listed first"

# On a Debian with nothing, tests/run brings at most 60 packages besides those that the build needs.
count_packages() { # count_packages PACKAGE...
  apt-get -s -o Dir::State::status=/dev/null install --no-install-recommends "$@" 2>/dev/null | grep -c '^Inst '
}
building=(g++ make cmake pkg-config libode-dev libcli11-dev catch2)
run tests/run
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
run tests/run --all --no-install
grep -q 'Going on without .*dpkg-dev' "$folder/errors" && [ ! -e "$folder/installed/dpkg-dev" ] || fail "$(cat "$folder/errors")"
[ "$(grep -c 'Going on without .*qemu-user' "$folder/errors")" -eq "${catch2_2:-0}" ] || fail "$(cat "$folder/errors")"
run tests/run --all
[ -e "$folder/installed/dpkg-dev" ] || fail "only $(ls "$folder/installed")"
[ "${catch2_2:-0}" = "$([ -e "$folder/installed/qemu-user" ] && echo 1 || echo 0)" ] || fail "only $(ls "$folder/installed")"
says "ctest: --test-dir build/release --parallel 2 --output-on-failure --no-tests=error"

# Settings go to CMake, what follows to the program.
run examples/run -DODE_SOURCE_DIR=/some/where -DA=b --scene balls
says "cmake: --preset release -DBUILD_TESTING=OFF -DODE_SOURCE_DIR=/some/where -DA=b"
says "cmake: --build build/release --target pile ode-parallel-sap-libraries --parallel 2"
says "pile: --scene balls --snapshot build/release/pile.png --if-possible"
run examples/run -DA=b
says "pile: --scene cubes --compare 10 --snapshot build/release/pile.png --if-possible"

# A picture that is asked for is the only one; what draws it is then needed, otherwise wanted.
for arguments in "--view" "--snapshot a.png" "--help"; do
  # shellcheck disable=SC2086 # they are words
  run examples/run $arguments
  says "pile: $arguments"
done
rm "$folder/installed/libgl1-mesa-dri" "$folder/installed/libpng-dev"
UNKNOWN=libgl1-mesa-dri run examples/run
[ $status -eq 0 ] || fail "examples/run ends with $status where a package for pictures is not to be had"
grep -q 'Going on without libgl1-mesa-dri$' "$folder/errors" || fail "$(cat "$folder/errors")"
[ -e "$folder/installed/libpng-dev" ] || fail "only $(ls "$folder/installed")"
says "pile: --scene cubes --compare 10 --snapshot build/release/pile.png --if-possible"
UNKNOWN=libgl1-mesa-dri run examples/run --snapshot a.png
[ $status -eq 1 ] || fail "examples/run ends with $status where a picture that was asked for cannot be"
run examples/run
run tests/run -DODE_SOURCE_DIR=/some/where -R pairs
says "cmake: --preset release -DODE_SOURCE_DIR=/some/where"
says "ctest: --test-dir build/release --parallel $(nproc) --output-on-failure --no-tests=error -R pairs -LE ^rebuild\$"
