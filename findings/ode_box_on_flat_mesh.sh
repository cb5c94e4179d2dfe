#!/usr/bin/env bash
# Where are the contacts of a box of 1 m that lies flat on a mesh of two triangles?
# Expected: within the box's footprint, as on a plane or a large box.
# Seen: on the mesh some lie beside the box in one of eighty poses, by up to 1.1 m, and turn it like a lever.
. "$(dirname "$0")/packages.sh"
ode
program -lode <<'END'
#include <ode/ode.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>

static const double kVertices[] = {-5, -5, 0, 5, -5, 0, 5, 5, 0, -5, 5, 0};
static const dTriIndex kTriangles[] = {0, 1, 2, 0, 2, 3};

static void report(const char* name, dGeomID ground) {
  dGeomID box = dCreateBox(0, 1, 1, 1);
  std::srand(7);
  const auto random = [] { return std::rand() / (double)RAND_MAX - 0.5; };
  int touching = 0, beside = 0;
  double farthest = 0;
  for (int pose = 0; pose < 20000; ++pose) {
    dMatrix3 turn;
    dRFromEulerAngles(turn, random() * 0.01, random() * 0.01, random() * 6);
    dGeomSetRotation(box, turn);
    const double x = random(), y = random();
    dGeomSetPosition(box, x, y, 0);
    dReal bounds[6];
    dGeomGetAABB(box, bounds);
    dGeomSetPosition(box, x, y, -bounds[4] - 0.002);  // 2 mm deep
    dContactGeom contacts[64];
    const int n = dCollide(box, ground, 64, contacts, sizeof *contacts);
    double off = 0;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 2; ++k)
        off = std::fmax(off, std::fmax(bounds[2 * k] - contacts[i].pos[k], contacts[i].pos[k] - bounds[2 * k + 1]));
    touching += n > 0, beside += off > 0.01, farthest = std::fmax(farthest, off);
  }
  std::printf("on a %s: %d poses, contacts over 1 cm beside the box in %d, farthest %.1f m\n", name, touching, beside, farthest);
}

int main() {
  dInitODE2(0);
  report("plane", dCreatePlane(0, 0, 0, 1, 0));
  dGeomID large = dCreateBox(0, 10, 10, 1);
  dGeomSetPosition(large, 0, 0, -0.5);
  report("large box", large);
  dTriMeshDataID data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildDouble(data, kVertices, 24, 4, kTriangles, 6, 12);
  report("mesh", dCreateTriMesh(0, data, 0, 0, 0));
}
END
shows <<'END'
on a plane: 20000 poses, contacts over 1 cm beside the box in 0, farthest 0.0 m
on a large box: 20000 poses, contacts over 1 cm beside the box in 0, farthest 0.0 m
on a mesh: 20000 poses, contacts over 1 cm beside the box in 245, farthest 1.1 m
END
