#!/usr/bin/env bash
# Do geoms that move from one of ODE's spaces to another collide there, whether or not they moved since the last collide?
# Expected: yes. A space takes whatever is added for moved.
# Seen: dSpaceAdd keeps the mark of a geom. Spaces look for moved geoms up to the first one that has not moved. One that moved
# and is added before one that rests stays without a new AABB: an assertion fails, or without assertions its pair is missed.
# After dSpaceClean of the first space, or if the other geom is added first, the pair is found.
. "$(dirname "$0")/packages.sh"
ode
program -lode <<'END'
#include <ode/ode.h>
#include <cstdarg>
#include <cstdio>

static void count(void* pairs, dGeomID, dGeomID) { ++*(int*)pairs; }

static void complain(int, const char* format, va_list arguments) {
  std::vprintf(format, arguments);
  std::printf("\n");
  throw 0;
}

// Two spheres rest in a space. One moves to the other, then both go to a second space, where they overlap.
static void collide(const char* name, bool moved_first, bool clean) {
  dSpaceID first = dSimpleSpaceCreate(0), second = dSimpleSpaceCreate(0);
  dGeomID rests = dCreateSphere(first, 1), moves = dCreateSphere(first, 1);
  dGeomSetPosition(moves, 5, 0, 0);
  int pairs = 0;
  dSpaceCollide(first, &pairs, count);
  dGeomSetPosition(moves, 1, 0, 0);
  if (clean) dSpaceClean(first);
  dSpaceRemove(first, rests);
  dSpaceRemove(first, moves);
  dSpaceAdd(second, moved_first ? moves : rests);
  dSpaceAdd(second, moved_first ? rests : moves);
  std::printf("%s: ", name);
  try {
    dSpaceCollide(second, &pairs, count);
    std::printf("%d pair\n", pairs);
  } catch (int) {
  }
}

int main() {
  dInitODE2(0);
  dSetDebugHandler(complain);
  collide("the moved one added last", false, false);
  collide("the moved one added first, after dSpaceClean", true, true);
  collide("the moved one added first", true, false);
}
END
shows <<'END'
the moved one added last: 1 pair
the moved one added first, after dSpaceClean: 1 pair
the moved one added first: assertion "(g2->gflags & GEOM_AABB_BAD)==0" failed in collideAABBs() [collision_space_internal.h:48]
END
