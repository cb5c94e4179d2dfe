#!/usr/bin/env bash
# Do ODE's dHashSpace and dSimpleSpace report the same pairs?
# Expected: the same, wherever the boxes are; a hash can only cost time.
# Seen: dHashSpace misses 27 of 1,000 stacked boxes around the origin, and 137 of 1,000 at another place below z = 0, while
# dCollide finds contacts of each. 100 m higher it misses none.
. "$(dirname "$0")/packages.sh"
ode
program -lode <<'END'
#include <ode/ode.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>

static void count(void* pairs, dGeomID, dGeomID) { ++*(int*)pairs; }

static int missed(double x, double y, double z) {  // of 1,000 pairs, a box standing on another, near this place
  int result = 0;
  srand(1);
  const auto random = [] { return rand() / (double)RAND_MAX - 0.5; };
  for (int i = 0; i < 1000; ++i) {
    dSpaceID space = dHashSpaceCreate(0);
    dGeomID lower = dCreateBox(space, 0.5, 0.5, 0.5), upper = dCreateBox(space, 0.5, 0.5, 0.5);
    dGeomSetPosition(lower, x + random(), y + random(), z + random());
    const dReal* at = dGeomGetPosition(lower);
    dGeomSetPosition(upper, at[0], at[1], at[2] + 0.499);
    int pairs = 0;
    dSpaceCollide(space, &pairs, count);
    dContactGeom contacts[8];
    result += pairs == 0 && dCollide(lower, upper, 8, contacts, sizeof *contacts) > 0;
    dSpaceDestroy(space);
  }
  return result;
}

int main() {
  dInitODE2(0);
  std::printf("missed of 1,000 pairs that overlap by 1 mm: %d at the origin, %d 100 m above, %d at (1.5, 0.5, -100)\n",
              missed(0, 0, 0), missed(0, 0, 100), missed(1.5, 0.5, -100));
}
END
shows <<'END'
missed of 1,000 pairs that overlap by 1 mm: 27 at the origin, 0 100 m above, 137 at (1.5, 0.5, -100)
END
