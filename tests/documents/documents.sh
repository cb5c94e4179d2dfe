#!/usr/bin/env bash
# documents.sh SOURCE
#
# Files that the documents name are there: what a link leads to, and `paths` from the project's top, for which a
# name without its ending stands too (`space/pairs/cell_order` for the header and the source).
set -euo pipefail
cd -- "$1"
failed=0 count=0
fail() {
  echo "$*"
  failed=1
}
is_there() { [ -e "$1" ] || compgen -G "$1" >/dev/null || compgen -G "$1.*" >/dev/null; }

while read -r document; do
  folder=$(dirname "$document")
  while read -r link; do
    count=$((count + 1))
    [ -e "$folder/${link%%#*}" ] || fail "$document: the link to $link leads nowhere"
  done < <(grep -oE '\]\([^)#: ]+[^): ]*\)' "$document" | sed 's/^](//; s/)$//')
  while read -r path; do
    count=$((count + 1))
    is_there "$path" || fail "$document: there is no $path"
  done < <(grep -oE '`(space|cuda|tests|examples)/[A-Za-z0-9_./*-]*' "$document" | sed 's/^`//' | LC_ALL=C sort -u)
done < <(find . -name '*.md' -not -path './build*' -not -path './.*' | LC_ALL=C sort)
[ $count -gt 100 ] || fail "only $count names found in the documents"
[ $failed -eq 0 ] && echo "$count links and paths: all there"
exit $failed
