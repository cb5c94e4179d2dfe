// A stack of boxes on a plane: everything an ODE program needs to use dParallelSAPSpace.
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdio>

static dWorldID world;
static dJointGroupID contacts;

static void nearCallback(void*, dGeomID a, dGeomID b) {
  dContact contact[4] = {};
  const int count = dCollide(a, b, 4, &contact[0].geom, sizeof(dContact));
  for (int i = 0; i < count; ++i) {
    contact[i].surface.mode = dContactApprox1;
    contact[i].surface.mu = 0.5;
    dJointAttach(dJointCreateContact(world, contacts, &contact[i]), dGeomGetBody(a),
                 dGeomGetBody(b));
  }
}

int main() {
  dInitODE2(0);
  world = dWorldCreate();
  dWorldSetGravity(world, 0, 0, -9.81);
  contacts = dJointGroupCreate(0);
  dSpaceID space = dParallelSAPSpaceCreate(0);  // the only line that differs from any ODE program
  dCreatePlane(space, 0, 0, 1, 0);

  dBodyID top = 0;
  for (int i = 0; i < 5; ++i) {
    top = dBodyCreate(world);
    dMass mass;
    dMassSetBox(&mass, 1, 1, 1, 1);
    dBodySetMass(top, &mass);
    dBodySetPosition(top, 0, 0, 0.6 + 1.1 * i);
    dGeomSetBody(dCreateBox(space, 1, 1, 1), top);
  }

  for (int step = 0; step < 300; ++step) {
    dSpaceCollide(space, 0, nearCallback);
    dWorldQuickStep(world, 0.01);
    dJointGroupEmpty(contacts);
  }

  dParallelSAPStats stats;
  dParallelSAPSpaceGetStats(space, &stats);
  std::printf("%zu geoms, %llu pairs, the top box is at a height of %.2f\n", stats.geoms,
              stats.pairs, static_cast<double>(dBodyGetPosition(top)[2]));
  dSpaceDestroy(space);
  dJointGroupDestroy(contacts);
  dWorldDestroy(world);
  dCloseODE();
}
