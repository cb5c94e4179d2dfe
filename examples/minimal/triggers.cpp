// Triggers of a game: who enters and leaves. Touches are of shapes, not of their bounding boxes.
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdio>

static const char* nameOf(dGeomID geom) {
  return geom ? static_cast<const char*>(dGeomGetData(geom)) : "somebody who left the game";
}

static dGeomID named(dGeomID geom, const char* name) {
  dGeomSetData(geom, const_cast<char*>(name));
  return geom;
}

// A game would make joints here, but of pairs without a trigger only.
static void contactCallback(void*, dGeomID, dGeomID, const dContactGeom*, int) {}

int main() {
  dInitODE2(0);
  dSpaceID space = dParallelSAPSpaceCreate(0);
  dParallelSAPSpaceSetEvents(space, dParallelSAPEventTouches);
  named(dCreateSphere(space, 2), "the fire");
  dGeomID player = named(dCreateSphere(space, 0.5), "the player");
  dGeomID barrel = named(dCreateBox(space, 1, 1, 1), "the barrel");
  dGeomSetPosition(barrel, 0, 1, 0);

  dParallelSAPContactCallbacks callbacks = dParallelSAPContactCallbacksOf(contactCallback);
  for (int step = 0; step <= 12; ++step) {
    dGeomSetPosition(player, step - 6, -1.9, 0);  // runs past
    if (step == 9) dGeomDestroy(barrel);
    dParallelSAPSpaceCollideContacts(space, 0, 1, &callbacks);

    const dParallelSAPPairEvent* touches;
    size_t count = dParallelSAPSpaceGetBegunTouches(space, &touches);
    for (size_t i = 0; i < count; ++i)
      std::printf("%d: %s touches %s\n", step, nameOf(touches[i].o1), nameOf(touches[i].o2));
    count = dParallelSAPSpaceGetEndedTouches(space, &touches);
    for (size_t i = 0; i < count; ++i)
      std::printf("%d: %s no longer touches %s\n", step, nameOf(touches[i].o1),
                  nameOf(touches[i].o2));
  }
  dSpaceDestroy(space);
  dCloseODE();
}
