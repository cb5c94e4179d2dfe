#!/usr/bin/env bash
# documents.sh SOURCE
#
# Files that the documents name are there: what a link leads to, and `paths` from the project's top, for which a
# name without its ending stands too (`space/pairs/cell_order` for the header and the source). So are the files and the names
# in the code that space/README.md has in backticks, its recipes for changes among them: `name` (`file`), and `name` and `name`
# in `file`, are of that file.
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
# Names in the code are words of it, as `Pipeline::collide` or `threadsFor`; files are named from space/ or the top.
sources=$(mktemp)
trap 'rm -f "$sources"' EXIT
find space cuda tests examples CMakeLists.txt -type f -not -name '*.md' -not -path 'tests/documents/*' | LC_ALL=C sort >"$sources"
words=$(xargs -d '\n' grep -hIoE '[A-Za-z_][A-Za-z0-9_]*|operator==' <"$sources" | LC_ALL=C sort -u)
while read -r name; do
  count=$((count + 1))
  ! is_there "space/$name" && ! is_there "$name" && ! grep -qE "/${name//./[.]}([.][a-z]+)?$" "$sources" || continue
  for word in ${name//::/ }; do
    grep -qxF -- "${word%%(*}" <<<"$words" || fail "space/README.md: there is no $name"
  done
done < <(sed '/^## Forks of ODE/,$d' space/README.md | grep -oE '`[A-Za-z][A-Za-z0-9_.:/*=]*`' | tr -d '`' | LC_ALL=C sort -u)
while read -r phrase; do
  mapfile -t names < <(grep -oE '`[^`]+`' <<<"$phrase" | tr -d '`')
  file=${names[-1]} places=()
  [[ $phrase == *'('* ]] && names=("${names[-2]}") || unset 'names[-1]'
  mapfile -t places < <(compgen -G "space/$file*" || compgen -G "$file*" || grep -E "/${file//./[.]}([.][a-z]+)?$" "$sources" || true)
  for name in "${names[@]}"; do
    for word in ${name//::/ }; do
      count=$((count + 1))
      grep -qwF -- "${word%%(*}" "${places[@]}" /dev/null || fail "space/README.md: there is no $name in $file"
    done
  done
done < <(sed '/^## Forks of ODE/,$d' space/README.md | tr -s '\n ' ' ' |
  grep -oE '(`[^`]+`(, | and ))*`[^` ]+` (in `[^`]*[./][^`]*[a-z_]`|[(]`[a-z_]+/[^`]+`[)])')
[ $count -gt 100 ] || fail "only $count names found in the documents"
[ $failed -eq 0 ] && echo "$count links and paths: all there"
exit $failed
