#!/usr/bin/env bash
# includes.sh SOURCE
#
# Holds the rooms of space/ and cuda/ apart: what each may include is the table in space/README.md. In it a
# room includes only what stands above it, so there is no cycle. Headers are named from the project's top,
# and no two have one name, but for the rooms' tuned constants (tuning.h).
set -euo pipefail
cd -- "$1"
document=space/README.md
failed=0
fail() {
  echo "$*"
  failed=1
}

# The table as lines "room included-room" and, of a room without includes, "room".
table=$(sed -n '/^<!-- rooms -->/,/^<!-- end -->/p' "$document" | awk -F'|' '
  $2 ~ /`/ { gsub(/[` ]/, "", $2); gsub(/[` ]/, "", $4); count = split($4, names, ",")
    print $2; for (i = 1; i <= count; ++i) print $2, names[i] }')
[ "$table" ] || fail "$document has no table of rooms"
awk '
  NF == 1 { known[$1] = 1; next }
  $2 !~ /^(ODE|tests\/bench)$/ && (!known[$2] || $2 == $1) { print "the table has " $1 " include " $2 ", which is not above it"; bad = 1 }
  END { exit bad }' <<<"$table" || failed=1

# Lines "file header" of what is included, the standard library and the like left out. ODE stands for its headers
# and for our public one, which includes them.
mapfile -t files < <(find space cuda -type f \( -name '*.h' -o -name '*.c' -o -name '*.cpp' -o -name '*.cu' \
  -o -name '*.cuh' \) -not -path 'space/cmake/*' -not -path 'space/include/*' | LC_ALL=C sort)
included=$(awk '
  match($0, /^[ \t]*#[ \t]*include[ \t]*/) {
    name = substr($0, RLENGTH + 1)
    quoted = name ~ /^"/
    sub(/^["<]/, "", name)
    sub(/[">].*$/, "", name)
    if (name ~ /^ode(_parallel_sap)?\//) print FILENAME, "ODE"
    else if (quoted || name ~ /^(space|cuda)\//) print FILENAME, name
  }' "${files[@]}")

# These are named by themselves: ODE has them in its sources, CMake makes one.
not_ours='space/geoms/ode_private\.h (collision_kernel|collision_space_internal|collision_std|config|error|heightfield)\.h'

while read -r file header; do
  room=${file%/*}
  grep -qxE "$not_ours" <<<"$file $header" && continue
  if [ "$header" != ODE ] && [ ! -e "$header" ]; then
    fail "$file includes \"$header\", which is no file's name from the project's top"
    continue
  fi
  other=${header%/*}
  [ "$room" != "$other" ] || continue
  grep -qxF "$room $other" <<<"$table" || fail "$file includes $header: $room may not include $other ($document)"
done <<<"$included"
for room in $(printf '%s\n' "${files[@]%/*}" | sort -u); do
  grep -qxF "$room" <<<"$table" || fail "$document does not tell of $room"
done
for room in $(awk 'NF == 1' <<<"$table"); do
  ls "$room"/*.* >/dev/null 2>&1 || fail "$document tells of $room, in which there are no files"
done

twice=$(find space cuda \( -name '*.h' -o -name '*.cuh' \) -not -name tuning.h -printf '%f\n' | LC_ALL=C sort | uniq -d)
[ -z "$twice" ] || fail "headers of one name: $(echo $twice)"

# Of two types of one name in a namespace the linker takes either, and says nothing.
types=$(awk '
  FNR == 1 { space = "" }
  /^namespace/ { space = space "/" $2 }
  /^} *\/\/ namespace/ { sub(/\/[^\/]*$/, "", space) }
  /^(struct|class|enum) .*{/ && space !~ /{/ {
    gsub(/^(struct|class|enum) (class )?(alignas\([^)]*\) )?| final/, "")
    if (/^[A-Za-z]+ (:.*)?{/) print space, $1
  }' "${files[@]}" | LC_ALL=C sort | uniq -d)
[ -z "$types" ] || fail "types of one name: $types"
[ $failed -eq 0 ] && echo "${#files[@]} files, $(grep -c . <<<"$included") includes: all as the table says"
exit $failed
