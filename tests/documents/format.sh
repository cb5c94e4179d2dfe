#!/usr/bin/env bash
# format.sh SOURCE
#
# All sources are as .clang-format says, by the version 14 of clang-format; others format some lines otherwise.
set -euo pipefail
cd -- "$1"
format=$(command -v clang-format-14 || command -v clang-format || true)
case $([ "$format" ] && "$format" --version) in
  *"version 14."*) ;;
  *) echo "Skipped: no clang-format 14 (Debian: clang-format-14)" && exit 77 ;;
esac
mapfile -t files < <(find space cuda tests examples \( -name '*.h' -o -name '*.c' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' \) | LC_ALL=C sort)
[ ${#files[@]} -gt 100 ] || { echo "only ${#files[@]} files found"; exit 1; }
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -n 32 "$format" --dry-run -Werror
echo "${#files[@]} files: all formatted"
