#!/usr/bin/env bash
# skipped.sh: run by CTest when the tests are over (CTestCustom.cmake). Says why tests were skipped, each reason with
# the tests that gave it. CTest's own log still has the name that it bears while tests run: LastTest.log.tmp and, since
# CMake 4, some letters.
set -euo pipefail
cd Testing/Temporary
log=$(ls -t LastTest.log* | head -n 1)
awk '
  /^[0-9]+\/[0-9]+ Test: / { test = $3; said = 0 }
  !said && /^\[?\*?\]?(Skipped|SKIPPED)/ { said = 1; if (!($0 in tests)) order[++count] = $0; tests[$0] = tests[$0] " " test }
  END { for (i = 1; i <= count; ++i) print order[i] ":" tests[order[i]] }' "$log"
