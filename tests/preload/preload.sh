#!/usr/bin/env bash
# preload.sh TEST PRELOAD ARGUMENT...: a test of the preload library, each a function below. Ends with status 77 where the program
# does. Programs are those of this folder.
. "$(dirname "$0")/with_preload.sh"
here=$(dirname "$0")

# same_output ORDER LEAST MOST PROGRAM...: what it prints is the same whether or not contacts are found before it asks for them, on
# one thread and on four; and of LEAST to MOST pairs they are. Where ORDER is `any`, it is also what it prints without the preload
# library, whose spaces report in another order.
same_output() {
  local order=$1 least=$2 most=$3 program=("${@:4}") threads used
  export ODE_PARALLEL_SAP_TEST_GRAIN=1 ODE_PARALLEL_SAP_STATS=1
  play() { # CONTACTS THREADS: sets `told` and `used`
    ODE_PARALLEL_SAP_CONTACTS=$1 ODE_PARALLEL_SAP_THREADS=$2 run 0 "${program[@]}"
    mv "$folder/printed" "$folder/$1"
    cmp "$folder/off" "$folder/$1" || fail "the prints of $1 differ ($2 threads)"
    read_told
  }
  play off 4
  [ "$told" -eq 0 ] || fail "$told pairs were collided with off"
  [ -s "$folder/off" ] || fail "nothing was printed"
  for threads in 1 4; do
    play on $threads
    echo "$threads threads: $used of $told used"
    [ "$used" -ge "$least" ] && [ "$used" -le "$most" ] || fail "not $least to $most were used"
  done
  play auto 1
  [ "$told" -eq 0 ] || fail "$told pairs were collided by one thread"
  play auto 4
  [ "$order" != any ] || "${program[@]}" | cmp - "$folder/off" || fail "the prints differ from those with ODE's spaces"
}

# contacts_in_vain COLLIDE_PROGRAM: in 120 frames contacts are found beforehand where it asks for them, but for the pairs with planes
# and rays, and hardly ever where it does not.
contacts_in_vain() {
  local scenario calls pairs
  export ODE_PARALLEL_SAP_THREADS=4 ODE_PARALLEL_SAP_STATS=1 ODE_PARALLEL_SAP_TEST_GRAIN=1
  for scenario in plain bodies classes some flags-by-frame gone; do
    run 0 "$1" $scenario 120
    calls=$(wc -l <"$folder/printed")
    read_told
    pairs=$(awk '/ frames \(/ { print $2 * $9 }' "$folder/said")
    echo "$scenario: $told of $pairs pairs collided beforehand, $used used of $calls asked for"
    [ $((100 * (told - used))) -lt $((3 * pairs)) ] || fail "too many"
    case $scenario in plain | bodies | classes)
      [ $((100 * used)) -gt $((85 * calls)) ] || fail "too few" ;;
    esac
  done
}

# account SPACES_PROGRAM: the account at its end is that of what it did; ODE_PARALLEL_SAP_STATS is read as the library reads it.
account() {
  local program=$1 number='[0-9.]*' each callbacks rule off known
  has() { grep -q "^ode-parallel-sap: $1" "$folder/said" || fail "$2"; }
  once() { [ "$(grep -c "$1" "$folder/said")" -eq 1 ] || fail "not once: $1"; }
  quiet() { [ ! -s "$folder/said" ] || fail "this is said with $1"; }
  said() { ODE_PARALLEL_SAP_STATS=$1 run 0 "$program" account "${@:2}"; }
  said 1
  has '2 hash spaces replaced, 0 left$' "not two spaces"
  has "10 frames ([a-z0-9]*), a frame: 202 geoms, 401 pairs, 0 contacts, $number ms (update " "not ten frames of 401 pairs"
  has '0 pairs collided before dCollide was called for them: 0 of them were asked for, with 0 contacts$' "contacts of none"
  grep -q 'dSpaceCollide2 of 300 geoms ' "$folder/said" || fail "not 300 geoms in dSpaceCollide2"
  # The callbacks of a frame sleep for 8 ms.
  read -r each callbacks < <(sed -n "s/.* contacts, \($number\) ms (.* report \($number\))$/\1 \2/p" "$folder/said")
  awk -v each="$each" -v callbacks="$callbacks" 'BEGIN { exit !(callbacks >= 8 && each >= callbacks) }' ||
    fail "the callbacks took longer than that: $each, $callbacks"
  tail -n 1 "$folder/said" | grep -q '^ode-parallel-sap: ODE_PARALLEL_SAP_SKIP_STATIC=1 would leave out 50 % of the pairs ' ||
    fail "the last line does not name the option that would leave out static pairs"

  # Each of these variables reaches a program that knows nothing of it.
  for rule in SKIP_STATIC=1/200 SKIP_ASLEEP=1/201 CULL_PLANES=1/200 TOLERANCE=2/600 TOLERANCE=0.1/401; do
    (export "ODE_PARALLEL_SAP_${rule%/*}" && said 1)
    grep -q "a frame: 202 geoms, ${rule#*/} pairs" "$folder/said" || fail "not ${rule#*/} pairs with ${rule%/*}"
  done

  ODE_PARALLEL_SAP_CONTACTS=on said 1 collide
  has '10 frames ([a-z0-9]*), a frame: 202 geoms, 401 pairs, 160 contacts, ' "not 200 contacts in each frame but the first"
  has '1600 pairs collided before dCollide was called for them: 1600 of them were asked for, with 1600 contacts$' "not all were answered"
  awk -v narrow="$(sed -n "s/.* narrow \($number\), .*/\1/p" "$folder/said")" 'BEGIN { exit !(narrow > 0) }' ||
    fail "no time for the contacts"

  for off in 0 ''; do said "$off" && quiet "ODE_PARALLEL_SAP_STATS=$off"; done
  said yes
  once 'ODE_PARALLEL_SAP_STATS=yes is none of 0, 1 and is ignored$'
  ! grep -q 'replaced\|dSpaceCollide' "$folder/said" || fail "yes is understood"
  ODE_PARALLEL_SAP_CONTACTS=sometimes said 0
  once 'ODE_PARALLEL_SAP_CONTACTS=sometimes is none of auto, off, on and is ignored'
  ODE_PARALLEL_SAP_STAT=1 ODE_PARALLEL_SAP_REPLACE=hash said 0
  once 'ODE_PARALLEL_SAP_STAT is no variable of this library and is ignored; .* STATS, '
  once 'is ignored'
  for known in auto off on ''; do ODE_PARALLEL_SAP_CONTACTS=$known said 0 && quiet "ODE_PARALLEL_SAP_CONTACTS=$known"; done
}

# replace SPACES_PROGRAM: ODE_PARALLEL_SAP_REPLACE says which of its spaces are replaced: it makes one or two of each kind.
replace() {
  local program=$1 name kind wanted
  expect() { # LIST KIND...: with LIST, these kinds are replaced and no other
    ODE_PARALLEL_SAP_REPLACE=$1 ODE_PARALLEL_SAP_STATS=1 run 0 "$program"
    for kind in simple hash sap quadtree; do
      wanted="0 $kind spaces replaced, [1-9][0-9]* left"
      [[ " ${*:2} " != *" $kind "* ]] || wanted="[1-9][0-9]* $kind spaces replaced, 0 left"
      grep -q "^ode-parallel-sap: $wanted$" "$folder/said" || fail "$1: $kind"
    done
  }
  expect hash hash
  expect sap,quadtree sap quadtree
  expect 'simple, hash' simple hash
  expect none
  expect ''
  expect heap,quadtree,hashes quadtree
  for name in heap hashes; do
    [ "$(grep -c "^ode-parallel-sap: ODE_PARALLEL_SAP_REPLACE names $name, which is no kind of space .* and is ignored$" "$folder/said")" -eq 1 ] ||
      fail "$name is not named once"
  done
}

# silent SKIP PROGRAM...: it prints the same pairs whether the spaces look at each geom or are told by it what changed, with pairs at
# rest left out (SKIP 1) or not, and without these the same as with ODE's spaces. ODE_PARALLEL_SAP_NOTIFIED=check would find a change
# that the library does not intercept.
silent() {
  local notified
  export ODE_PARALLEL_SAP_SKIP_ASLEEP=$1 ODE_PARALLEL_SAP_SKIP_STATIC=$1
  "${@:2}" silent >"$folder/stock"
  [ "$(cut -d: -f3 "$folder/stock" | sort -u | wc -l)" -gt 5 ] || fail "the pairs are always the same"
  for notified in 0 1 check; do
    ODE_PARALLEL_SAP_NOTIFIED=$notified run 0 "${@:2}" silent
    mv "$folder/printed" "$folder/$notified"
    [ ! -s "$folder/said" ] || fail "that was said with $notified"
  done
  run 0 "${@:2}" silent
  for notified in 1 check printed; do cmp "$folder/0" "$folder/$notified"; done
  [ "$1" = 1 ] || cmp "$folder/stock" "$folder/0"
}

# by_dlsym LIBRARY LINKED COMPILER: a program that gets ODE's functions by dlsym is told so at its end, and what
# space/preload/README.md says it can do works. LINKED is linked with the same ODE.
by_dlsym() {
  local library=$1 ode
  ode=$(ldd "$2" | awk '$1 ~ /^libode\./ { print $3 }')
  [ "$ode" ] || { echo "Skipped: ODE is not a shared library of its own"; exit 77; }
  command -v python3 >/dev/null || { echo "Skipped: needs python3"; exit 77; }
  finds() {
    run 0 python3 "$here/by_dlsym.py" "$@"
    grep -qx '3 pairs' "$folder/printed" || fail "not the three pairs"
  }
  finds "$ode" "$ode" dHashSpaceCreate
  [ ! -s "$folder/said" ] || fail "something is said without ODE_PARALLEL_SAP_STATS"
  export ODE_PARALLEL_SAP_STATS=1
  finds "$ode" "$ode" dHashSpaceCreate
  [ "$(grep -c '^ode-parallel-sap: no space was made through the dynamic linker. .*dParallelSAPSpaceCreate of libode-parallel-sap.so' \
    "$folder/said")" -eq 1 ] || fail "nothing is said of the spaces that did not come"
  finds "$ode" "$library" dParallelSAPSpaceCreate

  # Without a change of the program: a library that it takes for ODE.
  mkdir "$folder/first"
  "$3" -shared -o "$folder/first/libode.so" -Wl,--no-as-needed "$preload" "$ode"
  preload+=$'\n'$ode
  finds "$folder/first/libode.so" "$folder/first/libode.so" dHashSpaceCreate
  grep -q '^ode-parallel-sap: 1 hash spaces replaced, 0 left$' "$folder/said" || fail "the space was not replaced"

  # The lines of Python, with an ODE found as bindings find it.
  {
    echo "import ctypes; ode = ctypes.CDLL('$ode'); ode.dInitODE2(0)"
    sed -n '/^```python/,/^```/p' "$here/../../space/preload/README.md" | grep -v '^```'
    echo "print(ode.dGeomIsSpace(space), sap.dSpaceIsParallelSAP(space))"
  } >"$folder/lines.py"
  [ "$(LD_LIBRARY_PATH=$(dirname "$library") python3 "$folder/lines.py")" = "1 1" ] || fail "the lines of Python make no space"
}

# without_ode: a program without ODE stays without it, and nothing is said.
without_ode() {
  ODE_PARALLEL_SAP_STATS=1 with_preload "$preload" cat /proc/self/maps >"$folder/said" 2>&1
  grep -q "$(basename "$preload")" "$folder/said" || fail "$preload was not loaded"
  ! grep -E 'libode|libstdc|libgomp|ode-parallel-sap:' "$folder/said" | grep -v "/$(basename "$preload")" ||
    fail "the preload library said this, or brought it along"
}

# left_alone COMPLAINT PROGRAM [LIBRARY]: with an ODE that does not fit, a program prints what it prints without the preload library,
# and the reason is said once. LIBRARY makes a misfit of the program's ODE.
left_alone() {
  with_preload "${3-}" "$2" >"$folder/stock"
  preload+=${3+$'\n'$3}
  ODE_PARALLEL_SAP_STATS=1 run 0 "$2"
  cat "$folder/said"
  [ -s "$folder/stock" ]
  cmp "$folder/stock" "$folder/printed"
  [ "$(grep -c 'nothing is replaced' "$folder/said")" -eq 1 ]
  grep -q "^ode-parallel-sap: nothing is replaced: .*$1" "$folder/said"
  ! grep -q ': [1-9][0-9]* .* spaces replaced' "$folder/said"
}

# pair_check CHECK PROGRAM...: every call must report the owed pairs, and there must be some (pair_check.cpp).
pair_check() {
  ODE_PARALLEL_SAP_STATS=1 with_preload "$1"$'\n'"$preload" "${@:2}" 2>&1 </dev/null | tee "$folder/said"
  grep -q '^ode-parallel-sap: [1-9][0-9]* [a-z]* spaces replaced' "$folder/said" || fail "no space was replaced"
  grep -q '^pair check: [1-9][0-9]* calls, [1-9][0-9]* pairs, all right$' "$folder/said" || fail "no pairs"
}

# dart_far DART_SCENE: DART with a small body at -1e9 m: its own hash space ends the program, a replaced one goes on, and the body
# beside it comes to lie on the ground.
dart_far() {
  local status=0
  (ulimit -c 0 && exec "$1" far) >"$folder/out" 2>"$folder/said" || status=$?
  [ $status -eq 134 ] || fail "without the preload library: status $status, not 134, an abort"
  grep -q 'assertion "aabbBound >= dMinIntExact' "$folder/said" || fail "aborted by something else"
  ODE_PARALLEL_SAP_STATS=1 run 0 "$1" far
  grep -q '^ode-parallel-sap: 1 hash spaces replaced' "$folder/said" || fail "no space was replaced"
  # A box of height 1 lies on the ground, and the body that is far away has fallen from 1 m for 0.3 s.
  grep -q '^2 shapes, mean height 0\.52[0-9]*, .* [1-9][0-9]* contacts ' "$folder/printed" || fail "$(cat "$folder/printed")"
}

# trace_of REPLAY FRAMES PROGRAM...: its trace replays with the pairs that it had, in FRAMES frames or more.
trace_of() {
  local replay=$1 options same
  ODE_PARALLEL_SAP_TRACE=$folder/trace run 0 "${@:3}"
  "$replay" "$folder/trace" --check | tee "$folder/said"
  same=$(sed -n "s/^\([0-9]*\) frames have the program's pairs, 0 have others, of 0 it is not known$/\1/p" "$folder/said")
  [ "${same:-0}" -ge "$2" ] || fail "not $2 frames"
  # A table of what the options give has all its rows.
  "$replay" "$folder/trace" --turns 1 --threads 1,2 --tolerance 0.01 --spaces hash --csv "$folder/table.csv"
  [ "$(wc -l <"$folder/table.csv")" -eq 11 ] || fail "not ten rows: $(cat "$folder/table.csv")"
  # What is no whole trace is refused, and so are wrong options; help is none.
  head -c -5 "$folder/trace" >"$folder/cut"
  preload=
  run 2 "$replay" "$folder/cut" --check
  grep -q '^trace-replay: .*cut: it ends within a chunk' "$folder/said" || fail "a cut trace is replayed"
  for options in "" "--no-such-option" "$folder/trace --threads 0"; do
    # shellcheck disable=SC2086 # they are words
    run 2 "$replay" $options
  done
  run 0 "$replay" --help
}

# run STATUS PROGRAM...: under the library, which must end with this status. What it prints and what it says are files.
run() {
  local status=0
  with_preload "$preload" "${@:2}" >"$folder/printed" 2>"$folder/said" || status=$?
  [ $status -ne 77 ] || { cat "$folder/printed"; exit 77; }
  [ $status -eq "$1" ] || fail "ends with status $status: ${*:2}"
}
read_told() { # how many pairs were collided beforehand, and used
  read -r told used < <(sed -n 's/^ode-parallel-sap: \([0-9]*\) pairs collided before .*: \([0-9]*\) of them .*/\1 \2/p' "$folder/said")
}

preload=$2
"$1" "${@:3}"
