#!/usr/bin/env bash
# by_dlsym.sh PRELOAD LIBRARY PROGRAM LINKED COMPILER
#
# A program that gets ODE's functions by dlsym (dlsym_program.c) is told so at its end, and what README.md says it can do
# works. LINKED is linked with the same ODE.
. "$(dirname "$0")/with_preload.sh"
preload=$1 library=$2 program=$3 compiler=$5
ode=$(ldd "$4" | awk '$1 ~ /^libode\./ { print $3 }')
[ "$ode" ] || { echo "Skipped: ODE is not a shared library of its own"; exit 77; }

# run LIBRARIES COMMAND...: sets `said`; the program must find its pairs
run() {
  with_preload "$@" 2>"$folder/said" >"$folder/printed" || fail "ends with status $?"
  grep -qx '3 pairs' "$folder/printed" || fail "not the three pairs"
}
none='^ode-parallel-sap: no space was made through the dynamic linker. .*dParallelSAPSpaceCreate of libode-parallel-sap.so'

run "$preload" "$program" "$ode" "$ode" dHashSpaceCreate
[ ! -s "$folder/said" ] || fail "something is said without ODE_PARALLEL_SAP_STATS"
export ODE_PARALLEL_SAP_STATS=1
run "$preload" "$program" "$ode" "$ode" dHashSpaceCreate
[ "$(grep -c "$none" "$folder/said")" -eq 1 ] || fail "nothing is said of the spaces that did not come"
run "$preload" "$program" "$ode" "$library" dParallelSAPSpaceCreate

# Without a change of the program: a library that it takes for ODE.
mkdir "$folder/first"
"$compiler" -shared -o "$folder/first/libode.so" -Wl,--no-as-needed "$preload" "$ode"
run "$preload"$'\n'"$ode" "$program" "$folder/first/libode.so" "$folder/first/libode.so" dHashSpaceCreate
grep -q '^ode-parallel-sap: 1 hash spaces replaced, 0 left$' "$folder/said" || fail "the space was not replaced"

# The lines of Python in README.md, with an ODE found as bindings find it.
if command -v python3 >/dev/null; then
  {
    echo "import ctypes; ode = ctypes.CDLL('$ode'); ode.dInitODE2(0)"
    sed -n '/^```python/,/^```/p' "$(dirname "$0")/../../space/preload/README.md" | grep -v '^```'
    echo "print(ode.dGeomIsSpace(space), sap.dSpaceIsParallelSAP(space))"
  } >"$folder/lines.py"
  [ "$(LD_LIBRARY_PATH=$(dirname "$library") python3 "$folder/lines.py")" = "1 1" ] || fail "the lines of Python make no space"
fi
