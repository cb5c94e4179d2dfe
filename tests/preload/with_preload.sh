# Sourced by the other scripts.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# fail WORD...: shows what was said, and why that is wrong
fail() {
  cat "$folder/said"
  echo "$*"
  exit 1
}

# with_preload "LIBRARY..." COMMAND... runs a command under these libraries. LD_PRELOAD cannot
# name a path that has a space in it, so they are found by name; lists are split at newlines.
with_preload() {
  local library path= names=
  while read -r library; do
    path+=$(dirname "$library"):
    names+=${names:+:}$(basename "$library")
  done <<<"$1"
  shift
  LD_LIBRARY_PATH=$path${LD_LIBRARY_PATH-} LD_PRELOAD=$names "$@"
}
