#!/usr/bin/env bash
# sizes.sh [SOURCE] [--list]
#
# How large the rooms of space/ and cuda/ are: files, lines, and numeric constants that have a name
# (constexpr), as a markdown table. Tuned are those that are numbers as they stand: neither computed from others, nor
# masks and flags, nor marked by a comment "fixed: why" (sizes.awk says how). Another commit's:
#   git archive COMMIT space cuda | tar -x -C DIR && tests/project/sizes.sh DIR
# With --list: the tuned constants themselves.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source=$here/../.. list=
for argument in "$@"; do
  case $argument in
    --list) list=1 ;;
    *) source=$argument ;;
  esac
done
cd "$source"
mapfile -t files < <(find space cuda -type f \( -name '*.h' -o -name '*.c' -o -name '*.cpp' -o -name '*.cu' \
  -o -name '*.cuh' \) -not -path 'space/cmake/*' | LC_ALL=C sort)
if [ "$list" ]; then
  awk -v list=1 -f "$here/sizes.awk" "${files[@]}"
  exit
fi
echo "| room | files | lines | constants | tuned |"
echo "| --- | ---: | ---: | ---: | ---: |"
awk -f "$here/sizes.awk" "${files[@]}" | LC_ALL=C sort | awk '
  { printf "| `%s` | %d | %d | %d | %d |\n", $1, $2, $3, $4, $5
    whole = $1; sub(/\/.*/, "", whole)
    files[whole] += $2; lines[whole] += $3; constants[whole] += $4; tuned[whole] += $5 }
  END { for (i = 0; i < 2; ++i) { whole = i ? "cuda" : "space"
    printf "| all of `%s` | %d | %d | %d | %d |\n",
      whole, files[whole], lines[whole], constants[whole], tuned[whole] } }'
