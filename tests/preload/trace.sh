#!/usr/bin/env bash
# trace.sh PRELOAD REPLAY PROGRAM [ARGUMENT...]
#
# A trace of PROGRAM (trace_program.c) has the very pairs that it prints, also where only every third frame is written;
# of a file that is cut off, was changed or is not there, the replay says so and ends with 2.
set -euo pipefail
. "$(dirname "$0")/with_preload.sh"
preload=$1 replay=$2
shift 2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
fail() {
  echo "$*"
  exit 1
}

ODE_PARALLEL_SAP_TRACE=whole with_preload "$preload" "$@" >printed
"$replay" whole --pairs >replayed
cmp printed replayed || fail "the trace has other pairs"
[ "$(grep -c -- - printed)" -ge 60 ] || fail "the program prints no 60 frames with pairs"
"$replay" whole --check | grep -q '^60 frames have the program.s pairs, 0 have others, of 0 it is not known$' ||
  fail "the replay does not find 60 frames"

ODE_PARALLEL_SAP_TRACE=third:3 with_preload "$preload" "$@" >/dev/null
"$replay" third --pairs >replayed
awk 'NR % 3 == 1' printed | cmp - replayed || fail "every third frame has other pairs"
[ "$(stat -c %s third)" -lt "$(stat -c %s whole)" ] || fail "every third frame takes as much room as all"

# refused TEXT COMMAND...: ends with 2 and says so
refused() {
  local text=$1 status=0
  shift
  "$@" >said 2>&1 || status=$?
  [ $status -eq 2 ] && grep -q "^trace-replay: .*$text" said || fail "$* ends with $status and says: $(cat said)"
}
head -c -5 whole >cut
refused 'cut: it ends within a chunk' "$replay" cut --check
{ head -c 5000 whole; printf x; tail -c +5002 whole; } >changed
refused 'changed: .*checksum is wrong' "$replay" changed
refused 'none: it cannot be read' "$replay" none
: >empty
refused 'empty: it is no trace' "$replay" empty

# Where the disk is full after some frames, the file holds those before.
said=$(trap '' XFSZ; ulimit -f 150; ODE_PARALLEL_SAP_TRACE=full with_preload "$preload" "$@" 2>&1 >/dev/null)
[ "$(grep -c 'the trace full ends here: File too large' <<<"$said")" -eq 1 ] || fail "not once is said: $said"
"$replay" full --pairs >replayed
[ -s replayed ] || fail "there is no frame in what was written"
head -n "$(wc -l <replayed)" printed | cmp - replayed || fail "the frames before a full disk have other pairs"
[ "$(wc -l <replayed)" -lt 60 ] || fail "the disk was not full"

# Where it cannot be written, the program says so once and does what it would do.
said=$(ODE_PARALLEL_SAP_TRACE=no/folder/trace with_preload "$preload" "$@" 2>&1 >again)
cmp printed again || fail "a trace that cannot be written changes the program"
[ "$(grep -c 'no/folder/trace cannot be written: No such file or directory' <<<"$said")" -eq 1 ] ||
  fail "not once is said: $said"
[ "$(wc -l <<<"$said")" -le 2 ] || fail "too much is said: $said"
