# Sourced by the other scripts.
. "$(dirname "$0")/../support/script.sh"

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
