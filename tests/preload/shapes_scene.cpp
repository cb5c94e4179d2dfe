// A program that knows ODE only: COUNT models of a box, a sphere and a cylinder on a ground plane,
// 3,003 shapes by default, whose near callback asks dCollide for up to 250 contacts, as DART's
// does. Prints what the collision of a step took, the least of all and the mean of the second half,
// and a sum of what was found.
//
//     shapes_scene [all|some|flags|gone [COUNT [FRAMES]]]
//
// all: every pair is collided. In vain is what is found beforehand for the others: some: the
// callback drops two pairs of three by data of its own, others in each frame; flags: the most
// contacts are others in each frame; gone: nothing is collided in all frames but every 20th.
#include <ode/ode.h>

#include <algorithm>
#include <chrono>
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
  const int flags = program.mode == "flags" ? 200 + program.frame % 50 : 250;
  dContactGeom contacts[250];
  const int count = dCollide(a, b, flags, contacts, sizeof contacts[0]);
  ++program.calls;
  program.contacts += static_cast<unsigned>(count);
  for (int i = 0; i < count; ++i) program.depths += static_cast<double>(contacts[i].depth);
}

std::vector<dGeomID> makeModels(dSpaceID space, int models) {
  std::vector<dGeomID> geoms;
  for (int i = 0; i < models; ++i) {
    geoms.push_back(dCreateBox(space, 1, 1, 1));
    geoms.push_back(dCreateSphere(space, 0.5));
    geoms.push_back(dCreateCylinder(space, 0.5, 1));
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
  using Clock = std::chrono::steady_clock;
  Program program;
  program.mode = argc > 1 ? argv[1] : "all";
  const int models = argc > 2 ? std::atoi(argv[2]) : 1001;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 200;
  dInitODE2(0);
  const dSpaceID space = dHashSpaceCreate(nullptr);
  const std::vector<dGeomID> geoms = makeModels(space, models);
  dCreatePlane(space, 0, 0, 1, 0);
  std::vector<double> times;
  for (; program.frame < frames; ++program.frame) {
    place(geoms, program.frame);
    program.pairs = 0;
    const Clock::time_point begin = Clock::now();
    dSpaceCollide(space, &program, near);
    times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
  }
  double sum = 0;
  for (std::size_t i = times.size() / 2; i < times.size(); ++i) sum += times[i];
  std::printf("%d shapes, %u pairs, %llu calls, %llu contacts, depths %.6f\n", 3 * models,
              program.pairs, program.calls, program.contacts, program.depths);
  std::fprintf(stderr, "collision of a step: %.3f ms at least, %.3f ms on average\n",
               *std::min_element(times.begin(), times.end()),
               sum / static_cast<double>(times.size() - times.size() / 2));
  dSpaceDestroy(space);
  dCloseODE();
  return 0;
}
