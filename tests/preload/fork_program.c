/* A program that knows ODE only. Collides falling boxes, forks, and prints in parent, child and
 * grandchild how many pairs there were and how many contacts. A child that hangs is killed, and the
 * program fails. */
#include <ode/ode.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

enum { boxes = 3000, side = 15 };

static dGeomID geoms[boxes];
static unsigned long pairs, contacts;

static void near(void* data, dGeomID a, dGeomID b) {
  (void)data;
  dContactGeom found[8];
  ++pairs;
  contacts += (unsigned long)dCollide(a, b, 8, found, sizeof found[0]);
}

static void collide(dSpaceID space, const char* who) {
  for (int frame = 0; frame < 5; ++frame) {
    for (int i = 0; i < boxes; ++i)
      dGeomSetPosition(geoms[i], 0.93 * (i % side), 0.94 * (i / side % side) + 0.01 * frame,
                       0.95 * (i / side / side));
    dSpaceCollide(space, NULL, near);
  }
  printf("%s: %lu pairs, %lu contacts\n", who, pairs, contacts);
  fflush(stdout);
}

/* Whether the process that is forked here ends well. The child goes on with `level` - 1. */
static int descend(dSpaceID space, int level) {
  static const char* const names[] = {"grandchild", "child"};
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    collide(space, names[level]);
    _exit(level == 0 || descend(space, level - 1) ? 0 : 1);
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

int main(void) {
  dInitODE2(0);
  const dSpaceID space = dHashSpaceCreate(NULL);
  for (int i = 0; i < boxes; ++i) geoms[i] = dCreateBox(space, 1, 1, 1);
  collide(space, "parent");
  const int well = descend(space, 1);
  collide(space, "parent again");
  dSpaceDestroy(space);
  dCloseODE();
  return well ? 0 : 1;
}
