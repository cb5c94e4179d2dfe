// A program that knows ODE only: COUNT models of a box, a sphere and a cylinder on a ground plane,
// one model in four with bodies, whose near callback asks dCollide for up to 250 contacts, as
// DART's does. Prints a sum of what was found.
//
//     shapes_scene MODE [COUNT [FRAMES]]
//
// all: every pair is collided. static: but those without bodies, more than half. classes: spheres
// for fewer contacts. In vain is what is found beforehand for the others: some: the callback drops
// two pairs of three by data of its own, others in each frame; flags: the most contacts are others
// in each frame; gone: nothing is collided in all frames but every 20th.
#include <ode/ode.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

struct Program {
  std::string mode;
  int frame = 0;
  unsigned pairs = 0;
  unsigned long long calls = 0, contacts = 0;
  double depths = 0;
};

void near(void* data, dGeomID a, dGeomID b) {
  Program& program = *static_cast<Program*>(data);
  const unsigned pair = program.pairs++;
  if (program.mode == "some" && (pair * 2654435761u >> 16) % 3 != unsigned(program.frame) % 3)
    return;
  if (program.mode == "gone" && program.frame % 20 != 1) return;
  if (program.mode == "static" && !dGeomGetBody(a) && !dGeomGetBody(b)) return;
  const bool sphere = dGeomGetClass(a) == dSphereClass || dGeomGetClass(b) == dSphereClass;
  int flags = 250;
  if (program.mode == "flags") flags = 200 + program.frame % 50;
  if (program.mode == "classes" && sphere) flags = 1;
  dContactGeom contacts[250];
  const int count = dCollide(a, b, flags, contacts, sizeof contacts[0]);
  ++program.calls;
  program.contacts += static_cast<unsigned>(count);
  for (int i = 0; i < count; ++i) program.depths += static_cast<double>(contacts[i].depth);
}

std::vector<dGeomID> makeModels(dWorldID world, dSpaceID space, int models) {
  std::vector<dGeomID> geoms;
  for (int i = 0; i < models; ++i) {
    geoms.push_back(dCreateBox(space, 1, 1, 1));
    geoms.push_back(dCreateSphere(space, 0.5));
    geoms.push_back(dCreateCylinder(space, 0.5, 1));
    if (i % 4 == 0)
      for (std::size_t k = geoms.size() - 3; k < geoms.size(); ++k)
        dGeomSetBody(geoms[k], dBodyCreate(world));
  }
  return geoms;
}

// In columns, so that each touches what is beside and below it.
void place(const std::vector<dGeomID>& geoms, int frame) {
  constexpr int side = 20;
  for (std::size_t i = 0; i < geoms.size(); ++i) {
    const int at = static_cast<int>(i);
    const dReal sway = static_cast<dReal>(0.001 * ((at * 7 + frame * 13) % 11));
    dGeomSetPosition(geoms[i], static_cast<dReal>(20 + 0.97 * (at % side)) + sway,
                     static_cast<dReal>(20 + 0.98 * (at / side % side)),
                     static_cast<dReal>(0.49 + 0.97 * (at / side / side)) - sway);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Program program;
  program.mode = argc > 1 ? argv[1] : "all";
  const int models = argc > 2 ? std::atoi(argv[2]) : 1001;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 200;
  dInitODE2(0);
  const dWorldID world = dWorldCreate();
  const dSpaceID space = dHashSpaceCreate(nullptr);
  const std::vector<dGeomID> geoms = makeModels(world, space, models);
  dCreatePlane(space, 0, 0, 1, 0);
  for (; program.frame < frames; ++program.frame) {
    place(geoms, program.frame);
    program.pairs = 0;
    dSpaceCollide(space, &program, near);
  }
  std::printf("%llu calls, %d shapes, %u pairs, %llu contacts, depths %.6f\n", program.calls,
              3 * models, program.pairs, program.contacts, program.depths);
  dSpaceDestroy(space);
  dWorldDestroy(world);
  dCloseODE();
  return 0;
}
