# Sourced by scripts: a folder of their own, and a function that shows what was said, if anything, and ends with a reason.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
  [ ! -e "$folder/said" ] || tail -n 60 "$folder/said"
  echo "$*"
  exit 1
}
quietly() { "$@" >"$folder/said" 2>&1 || fail "failed: $*"; }
skip() { echo "skipped: $*" && exit 77; }
