#!/usr/bin/env bash
# names.sh PHYSICS_ROWS: each scene of the program has a row in results/, and each row a scene, in either precision.
set -euo pipefail
cd "$(dirname "$0")/results"
listed=$("$1" list | sort -u)
for precision in double single; do
  diff <(echo "$listed") <({ sed -snE '2,$s/^("([^"]*)"|([^,]*)),.*/\2\3/p' truth.csv swept.csv
    sed -nE '2,$s/^[^,]*,[^,]*,("([^"]*)"|([^,]*)),.*/\2\3/p' $precision.csv; } | sort -u) && exit
done
exit 1
