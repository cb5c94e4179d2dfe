#!/usr/bin/env bash
# skipped.sh SOURCE
#
# CTest's output ends with the reason why a test was skipped, once for all tests that gave it.
. "$(dirname "$0")/../support/script.sh"
cd "$folder"
echo "set(CTEST_CUSTOM_POST_TEST [[\"$1/tests/support/skipped.sh\"]])" >CTestCustom.cmake
cat >CTestTestfile.cmake <<'CMAKE'
foreach(name one two)
  add_test(${name} sh -c "echo Skipped: no emulator && exit 77")
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77)
endforeach()
add_test(runs true)
CMAKE
quietly ctest
grep -qx 'Skipped: no emulator: one two' said || fail "it does not say why"
