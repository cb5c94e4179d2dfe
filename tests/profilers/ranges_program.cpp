// Runs each call of a space once, for the recorders beside it; prints what it calls.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdio>

namespace {

void say(const char* what) {
  std::fprintf(stderr, "%s\n", what);
}

void ignore(void*, dGeomID, dGeomID) {}
void ignoreContacts(void*, dGeomID, dGeomID, const dContactGeom*, int) {}
void ignorePairs(void*, const dParallelSAPPair*, size_t, size_t) {}

// Another space within the report, once.
void collideInner(void* inner, dGeomID, dGeomID) {
  dSpaceID& space = *static_cast<dSpaceID*>(inner);
  if (space) dSpaceCollide(space, nullptr, ignore);
  space = nullptr;
}

dSpaceID fill(int n) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  for (int i = 0; i < n; ++i)
    dGeomSetPosition(dCreateSphere(space, 1), static_cast<dReal>(i), 0, 0);
  return space;
}

}  // namespace

int main() {
  dInitODE2(0);
  const dSpaceID space = fill(300), other = fill(300);
  say("collide");
  dSpaceCollide(space, nullptr, ignore);
  say("contacts");
  const dParallelSAPContactCallbacks callbacks = {ignoreContacts, nullptr, nullptr, nullptr};
  dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
  say("pairs with events");
  dParallelSAPSpaceSetEvents(space, 1);
  dParallelSAPSpaceCollidePairs(space, nullptr, 0, ignorePairs);
  dParallelSAPSpaceSetEvents(space, 0);
  say("nested");
  dSpaceID inner = other;
  dSpaceCollide(space, &inner, collideInner);
  say("thrown");
  try {
    dSpaceCollide(space, nullptr, [](void*, dGeomID, dGeomID) { throw 1; });
  } catch (int) {
    say("caught");
  }
  say("rays");
  dParallelSAPRay ray = {{-5, 0, 0}, {1, 0, 0}, 10, ~0ul, ~0ul};
  dParallelSAPRayHit hit;
  dParallelSAPSpaceRays(space, &ray, 1, 0, &hit);
  say("end");
  dSpaceDestroy(space);
  dSpaceDestroy(other);
  dCloseODE();
}
