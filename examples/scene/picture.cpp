#include <drawstuff/drawstuff.h>
#include <internal.h>

#include <algorithm>
#include <array>

#include "../pile/view/offscreen.h"
#include "warehouse.h"

namespace scene {
namespace {

constexpr int width = 800, height = 450;
constexpr float scale = 0.5F;  // drawstuff's world ends at 100
constexpr int shown_robot = 7;
const Warehouse* drawn;
std::string written;

std::array<float, 3> place(const dReal* at) {
  return {scale * static_cast<float>(at[0]), scale * static_cast<float>(at[1]),
          scale * static_cast<float>(at[2])};
}

float scaled(dReal length) {
  return scale * static_cast<float>(length);
}

void drawGeom(dGeomID geom) {
  const dBodyID body = dGeomGetBody(geom);
  if (!body)
    dsSetColor(0.95F, 0.96F, 0.88F);
  else if (dBodyIsEnabled(body))
    dsSetColor(1, 0.5F, 0.08F);
  else
    dsSetColor(0.45F, 0.3F, 0.85F);
  const std::array<float, 3> at = place(dGeomGetPosition(geom));
  std::array<float, 12> turned;
  std::copy_n(dGeomGetRotation(geom), 12, turned.begin());
  dVector3 size;
  if (dGeomGetClass(geom) == dSphereClass) {
    dsDrawSphere(at.data(), turned.data(), scaled(dGeomSphereGetRadius(geom)));
  } else if (dGeomGetClass(geom) == dCapsuleClass) {
    dGeomCapsuleGetParams(geom, &size[0], &size[1]);
    dsDrawCapsule(at.data(), turned.data(), scaled(size[1]), scaled(size[0]));
  } else if (dGeomGetClass(geom) == dBoxClass) {
    dGeomBoxGetLengths(geom, size);
    dsDrawBox(at.data(), turned.data(), place(size).data());
  }
}

void drawFrame(int) {
  for (const dGeomID geom : drawn->geoms()) drawGeom(geom);
  for (const dParallelSAPProbe& probe : drawn->probes()) {
    const dReal* const at = dGeomGetPosition(probe.geom);
    const dReal spot[] = {at[0], at[1], dReal(0.02)},
                size[] = {dReal(0.2), dReal(0.2), dReal(0.02)};
    dsSetColor(probe.touched ? 0.9F : 0, probe.touched ? 0 : 0.7F, 0);
    constexpr float unturned[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    dsDrawBox(place(spot).data(), unturned, place(size).data());
  }
  dsSetColorAlpha(0.9F, 0.1F, 0.5F, 0.6F);
  for (std::size_t i = 0; i < drawn->rays().size(); ++i) {
    const dParallelSAPRay& ray = drawn->rays()[i];
    const dParallelSAPRayHit& hit = drawn->hits()[i];
    const dReal length = hit.geom ? hit.distance : ray.length;
    dReal end[3];
    for (int axis = 0; axis < 3; ++axis)
      end[axis] = ray.origin[axis] + length * ray.direction[axis];
    dsDrawLine(place(ray.origin).data(), place(end).data());
  }
}

void aim() {
  const dReal* const robot = drawn->rays()[shown_robot * ray_count / robot_count].origin;
  const dReal camera[] = {robot[0] + 6, robot[1] + 1, 8};
  float angles[] = {189, -45, 0};
  dsSetViewpoint(place(camera).data(), angles);
}

}  // namespace

void draw(const Warehouse& warehouse, const std::string& file) {
  const pile::Offscreen memory(2 * width, 2 * height);
  drawn = &warehouse;
  written = file;
  dsFunctions functions = {};
  functions.version = DS_VERSION;
  functions.step = drawFrame;
  functions.path_to_textures = SCENE_TEXTURES;
  std::string words[] = {"scene", "-notex", "-noshadow"};
  char* arguments[] = {words[0].data(), words[1].data(), words[2].data()};
  dsSimulationLoop(3, arguments, 2 * width, 2 * height, &functions);
}

}  // namespace scene

// What drawstuff calls in place of its main loop.
void dsPlatformSimLoop(int w, int h, dsFunctions* functions, int) {
  dsStartGraphics(w, h, functions);
  scene::aim();
  dsDrawFrame(w, h, functions, 1);
  pile::savePicture(scene::written, 2);
  dsStopGraphics();
}
