#!/usr/bin/env bash
# arithmetic.sh LIBRARY OBJDUMP
#
# No product is fused with a sum, which would be rounded once instead of twice: in none of the kernels, whatever their
# instruction set, and nowhere else.
set -euo pipefail
library=$1 objdump=$2
code=$("$objdump" --disassemble --no-show-raw-insn "$library")
case $("$objdump" --file-headers "$library") in
  *x86-64*) fused='vfn?m(add|sub|addsub|subadd)[0-9]{3}[ps][sd]' product='v?mul[ps][sd]' ;;
  *aarch64*) fused='fn?m(add|sub|la|ls)' product='fmul' ;;
  *) echo "not known of this processor"; exit 77 ;;
esac
grep -qwE "$product" <<<"$code" || { echo "the disassembly was not understood"; exit 1; }
if grep -wE "$fused" <<<"$code"; then
  echo "these are rounded once"
  exit 1
fi
