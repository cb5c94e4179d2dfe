#!/usr/bin/env bash
# arithmetic.sh LIBRARY OBJDUMP
#
# No product is fused with a sum, which would be rounded once instead of twice: in none of the kernels, whatever their
# instruction set, and nowhere else.
. "$(dirname "$0")/../support/script.sh"
library=$1 objdump=$2
code=$("$objdump" --disassemble --no-show-raw-insn "$library")
case $("$objdump" --file-headers "$library") in
  *x86-64*) fused='vfn?m(add|sub|addsub|subadd)[0-9]{3}[ps][sd]' product='v?mul[ps][sd]' ;;
  *aarch64*) fused='fn?m(add|sub|la|ls)' product='fmul' ;;
  *) skip "not known of this processor" ;;
esac
grep -qwE "$product" <<<"$code" || fail "the disassembly was not understood"
! grep -wE "$fused" <<<"$code" || fail "these are rounded once"
