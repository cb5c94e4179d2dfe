#!/usr/bin/env bash
# constants.sh SOURCE
#
# Tuned constants, numbers that are what they are because of a measurement, are in one header a room: tuning.h.
# There are few of them in all. A number with a name anywhere else says in a comment why it is fixed (sizes.awk).
set -euo pipefail
most=90
here=$(cd "$(dirname "$0")" && pwd)
failed=0
list=$("$here/sizes.sh" "$1" --list)
elsewhere=$(grep -v '/tuning\.h:' <<<"$list" || true)
if [ "$elsewhere" ]; then
  echo "neither in the room's tuning.h nor marked as '// fixed: why':"
  echo "$elsewhere"
  failed=1
fi
count=$(grep -c '/tuning\.h:' <<<"$list" || true)
echo "$count tuned constants, of $most at most"
[ "$count" -le $most ] || failed=1
exit $failed
