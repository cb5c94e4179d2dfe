#!/usr/bin/env bash
# prefetches.sh SOURCE PROBE OBJECT...
#
# What the library asks for ahead of its use is asked for by its machine code, too: compilers leave out calls of functions
# that do nothing else (space/data/prefetch.h). No file asks in another way than by prefetch(), which the probe's compiler
# has not left out where it might (prefetch_probe.cpp), and each object of a file that asks has the instruction.
set -euo pipefail
source=$1 probe=$2
shift 2
case $("${OBJDUMP:-objdump}" --file-headers "$probe") in
  *x86-64* | *i386*) instruction='prefetch[a-z0-9]*' ;;
  *aarch64*) instruction=prfm ;;
  *) echo "skipped: the instruction of this processor is not known here" && exit 77 ;;
esac
failed=0
count_in() { "${OBJDUMP:-objdump}" --disassemble "$1" | grep -cE "\b$instruction\b" || true; }
[ "$(count_in "$probe")" -gt 0 ] || { echo "the compiler leaves out calls of what only asks: $probe" && failed=1; }
others=$(grep -rln --include='*.h' --include='*.cpp' '__builtin_prefetch' "$source/space" | grep -v '/data/prefetch\.h$' || true)
if [ "$others" ]; then
  echo "ask without prefetch(), which no compiler leaves out:" $others
  failed=1
fi
objects=0
for object in "$@"; do
  file=$source/space/${object#*.dir/}
  file=${file%.o}
  [ -f "$file" ] || { echo "$object: no source"; exit 1; }
  grep -qE '\b(prefetch[A-Za-z]*) *\(' "$file" || continue
  objects=$((objects + 1))
  count=$(count_in "$object")
  echo "$count $file"
  [ "$count" -gt 0 ] || failed=1
done
[ "$objects" -ge 8 ] || { echo "$objects objects only: the files are not found"; failed=1; }
exit $failed
