// A drum of 16 flat staves, a kinematic body that turns, with 2,000 spheres in it. What matters is
// how steep the spheres lie and how far up they are carried. Its study:
//
//   examples/tradeoff/run --budget 900 --program build/release/examples/tradeoff/drum-scene
#include "harness.h"

namespace {

constexpr int spheres = 2000, staves = 16;
constexpr double pi = 3.14159265358979, radius = 0.04, drum = 1.2, width = 0.8, turns = 0.1;
dBodyID wheel;
std::vector<dBodyID> balls;

// A plate of the drum: at this angle for a stave, or an end where `side` is not 0.
void addPlate(dSpaceID space, double angle, double side) {
  const double half = drum + 0.1, stave = 2 * half * std::tan(pi / staves) + 0.1;
  const dGeomID plate = side != 0 ? dCreateBox(space, 2 * half, 0.2, 2 * half)
                                  : dCreateBox(space, 0.2, width + 0.4, dReal(stave));
  dMatrix3 turn;
  dRFromAxisAndAngle(turn, 0, 1, 0, dReal(-angle));
  dGeomSetBody(plate, wheel);
  dGeomSetOffsetRotation(plate, turn);
  dGeomSetOffsetPosition(plate, dReal(side != 0 ? 0 : half * std::cos(angle)),
                         dReal(side * (width / 2 + 0.1)),
                         dReal(side != 0 ? 0 : half * std::sin(angle)));
}

void build(dWorldID world, dSpaceID space, unsigned long seed) {
  wheel = dBodyCreate(world);
  dBodySetKinematic(wheel);
  for (int i = 0; i < staves; ++i) addPlate(space, 2 * pi * i / staves, 0);
  for (double side : {-1.0, 1.0}) addPlate(space, 0, side);
  dRandSetSeed(seed);
  dMass mass;
  dMassSetSphere(&mass, 2500, dReal(radius));
  const double cell = 2.04 * radius;
  for (int layer = 0; int(balls.size()) < spheres; ++layer)
    for (int i = -14; i <= 14 && int(balls.size()) < spheres; ++i)
      for (int j = -4; j <= 4 && int(balls.size()) < spheres; ++j) {
        const double x = cell * i, z = cell * layer - drum + radius;
        if (std::hypot(x, z) > drum - 1.2 * radius) continue;
        const dBodyID ball = dBodyCreate(world);
        dBodySetMass(ball, &mass);
        const double shift = 0.02 * radius * double(dRandReal());
        dBodySetPosition(ball, dReal(x + shift), dReal(cell * j), dReal(z));
        dGeomSetBody(dCreateSphere(space, dReal(radius)), ball);
        balls.push_back(ball);
      }
}

void control(double) {
  dBodySetAngularVel(wheel, 0, dReal(2 * pi * turns), 0);
}

// The middle of all spheres: aside by how steep they lie, up by how far they are carried.
std::vector<tradeoff::Observation> observe() {
  tradeoff::Vector sum = {0, 0, 0};
  for (dBodyID ball : balls)
    tradeoff::addScaled(sum, 1.0 / spheres, tradeoff::vectorOf(dBodyGetPosition(ball)));
  return {{"aside", sum[0], drum}, {"up", sum[2], drum}};
}

}  // namespace

int main(int argc, char** argv) {
  tradeoff::Scene scene;
  scene.build = build;
  scene.control = control;
  scene.observe = observe;
  scene.observe_every = 5;
  scene.observe_from = 2;
  scene.seconds = 4;
  scene.rests = false;
  scene.ignores = "height+spread";  // of the last second; `up` is the mean of two
  return tradeoff::run(argc, argv, scene);
}
