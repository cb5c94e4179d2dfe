#!/usr/bin/env bash
# account.sh PRELOAD PROGRAM
#
# The account at the end of a program is that of what it did; ODE_PARALLEL_SAP_STATS is read as the
# library reads it. PROGRAM is account_program.c.
. "$(dirname "$0")/with_preload.sh"
preload=$1 program=$2

# said VALUE [ARGUMENT]: what the program and its libraries write to stderr
said() {
  local value=$1
  shift
  ODE_PARALLEL_SAP_STATS=$value with_preload "$preload" "$program" "$@" 2>&1 >/dev/null | tee "$folder/said"
}

account=$(said 1)
number='[0-9.]*'
grep -q '^ode-parallel-sap: 2 hash spaces replaced, 0 left$' <<<"$account" || fail "not two spaces"
grep -q "^ode-parallel-sap: 10 dSpaceCollide of 202 geoms with 401 pairs and 0 contacts took $number ms each: " \
  <<<"$account" || fail "not ten frames of 401 pairs"
grep -q '^ode-parallel-sap: 0 pairs collided before dCollide was called for them: 0 of them were asked for, with 0 contacts$' \
  <<<"$account" || fail "not 0 pairs for a program that collides none"
grep -q 'dSpaceCollide2 of 300 geoms ' <<<"$account" || fail "not 300 geoms in dSpaceCollide2"
# The callbacks of a frame sleep for 8 ms.
read -r each callbacks all < <(sed -n "s/.* took \($number\) ms each: .* callbacks \($number\); .* \($number\) s since .*/\1 \2 \3/p" <<<"$account")
awk -v each="$each" -v callbacks="$callbacks" -v all="$all" 'BEGIN { exit !(callbacks >= 8 && each >= callbacks && all >= each / 100) }' ||
  fail "the callbacks took longer than that: $each, $callbacks, $all"
tail -n 1 <<<"$account" | grep -q '^ode-parallel-sap: ODE_PARALLEL_SAP_SKIP_STATIC=1 would leave out 50 % of the pairs ' ||
  fail "the last line does not name the option that would leave out static pairs"

# Each of these variables reaches a program that knows nothing of it.
for rule in SKIP_STATIC=1/200 SKIP_ASLEEP=1/201 CULL_PLANES=1/200 TOLERANCE=2/600 TOLERANCE=0.1/401; do
  account=$(export "ODE_PARALLEL_SAP_${rule%/*}" && said 1)
  grep -q "dSpaceCollide of 202 geoms with ${rule#*/} pairs" <<<"$account" || fail "not ${rule#*/} pairs with ${rule%/*}"
done

account=$(ODE_PARALLEL_SAP_CONTACTS=on said 1 collide)
grep -q '^ode-parallel-sap: 10 dSpaceCollide of 202 geoms with 401 pairs and 160 contacts took ' <<<"$account" ||
  fail "not 200 contacts in each frame but the first"
grep -q '^ode-parallel-sap: 1600 pairs collided before dCollide was called for them: 1600 of them were asked for, with 1600 contacts$' \
  <<<"$account" || fail "not all pairs of spheres were answered"
awk -v narrow="$(sed -n "s/.* narrow \($number\), .*/\1/p" <<<"$account")" 'BEGIN { exit !(narrow > 0) }' ||
  fail "no time for the contacts"

for off in 0 ''; do
  account=$(said "$off")
  [ -z "$account" ] || fail "this is said with ODE_PARALLEL_SAP_STATS=$off"
done
account=$(said yes)
[ "$(grep -c 'ODE_PARALLEL_SAP_STATS=yes is none of 0, 1 and is ignored$' <<<"$account")" -eq 1 ] ||
  fail "a value that is not understood is not reported once"
! grep -q 'replaced\|dSpaceCollide' <<<"$account" || fail "yes is understood"

account=$(ODE_PARALLEL_SAP_CONTACTS=sometimes said 0)
[ "$(grep -c 'ODE_PARALLEL_SAP_CONTACTS=sometimes is none of auto, off, on and is ignored' <<<"$account")" -eq 1 ] ||
  fail "contacts that are not understood are not reported once"
account=$(ODE_PARALLEL_SAP_STAT=1 ODE_PARALLEL_SAP_REPLACE=hash said 0)
[ "$(grep -c 'ODE_PARALLEL_SAP_STAT is no variable of this library and is ignored; .* STATS, ' <<<"$account")" -eq 1 ] &&
  [ "$(grep -c 'is ignored' <<<"$account")" -eq 1 ] || fail "a misspelt variable is not reported once"
for known in auto off on ''; do
  account=$(ODE_PARALLEL_SAP_CONTACTS=$known said 0)
  [ -z "$account" ] || fail "this is said with ODE_PARALLEL_SAP_CONTACTS=$known"
done
