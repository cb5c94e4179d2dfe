#!/usr/bin/env bash
# Does a mesh cube of 1 m rest on the ground as well if its faces are cut into more triangles?
# Expected: a finer mesh rests as well, perhaps better; eight contacts hold any cube.
# Seen: on a mesh of two triangles, with at most 8 contacts, the cube of 12 triangles rests, the cube of 1,200 flies off. On a
# plane, with 4 contacts, the cube of 4,800 topples. The contacts are the first that are found, not the outermost ones.
. "$(dirname "$0")/packages.sh"
ode
program -lode <<'END'
#include <ode/ode.h>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <map>
#include <tuple>
#include <vector>

static dWorldID world;
static dJointGroupID group;
static int most_contacts;

static void touch(void*, dGeomID a, dGeomID b) {
  dContact contacts[64] = {};
  const int n = dCollide(a, b, most_contacts, &contacts[0].geom, sizeof(dContact));
  for (int i = 0; i < n; ++i) {
    contacts[i].surface.mu = 1;
    dJointAttach(dJointCreateContact(world, group, contacts + i), dGeomGetBody(a), dGeomGetBody(b));
  }
}

static dGeomID mesh(dSpaceID space, const std::vector<double>& vertices, const std::vector<dTriIndex>& triangles) {
  dTriMeshDataID data = dGeomTriMeshDataCreate();
  const auto& kept_vertices = *new std::vector<double>(vertices);
  const auto& kept_triangles = *new std::vector<dTriIndex>(triangles);
  dGeomTriMeshDataBuildDouble(data, kept_vertices.data(), 24, kept_vertices.size() / 3, kept_triangles.data(),
                              kept_triangles.size(), 12);
  return dCreateTriMesh(space, data, 0, 0, 0);
}

static dGeomID cube(dSpaceID space, int cuts) {  // closed, with shared vertices, each face a grid of cuts x cuts squares
  std::vector<double> vertices;
  std::vector<dTriIndex> triangles;
  std::map<std::tuple<int, int, int>, dTriIndex> known;
  const auto vertex = [&](int face, int i, int j) {
    int at[3];
    at[face % 3] = face < 3 ? 0 : cuts, at[(face + 1) % 3] = i, at[(face + 2) % 3] = j;
    const auto [place, is_new] = known.insert({{at[0], at[1], at[2]}, dTriIndex(vertices.size() / 3)});
    if (is_new)
      for (int coordinate : at) vertices.push_back(coordinate / (double)cuts - 0.5);
    return place->second;
  };
  for (int i = 0; i < cuts; ++i)
    for (int j = 0; j < cuts; ++j)
      for (int face = 0; face < 6; ++face) {
        const dTriIndex a = vertex(face, i, j), b = vertex(face, i + 1, j);
        const dTriIndex c = vertex(face, i + 1, j + 1), d = vertex(face, i, j + 1);
        if (face < 3) triangles.insert(triangles.end(), {a, c, b, a, d, c});
        else triangles.insert(triangles.end(), {a, b, c, a, c, d});
      }
  return mesh(space, vertices, triangles);
}

static const char* rest(int cuts, bool on_mesh, int contacts) {
  most_contacts = contacts;
  world = dWorldCreate(), group = dJointGroupCreate(0);
  dWorldSetGravity(world, 0, 0, -9.81);
  dRandSetSeed(1);
  dSpaceID space = dSimpleSpaceCreate(0);
  if (on_mesh) mesh(space, {-50, -50, 0, 50, -50, 0, 50, 50, 0, -50, 50, 0}, {0, 1, 2, 0, 2, 3});
  else dCreatePlane(space, 0, 0, 1, 0);
  dBodyID body = dBodyCreate(world);
  dMass mass;
  dMassSetBox(&mass, 1000, 1, 1, 1);
  dBodySetMass(body, &mass);
  dGeomSetBody(cube(space, cuts), body);
  dBodySetPosition(body, 0, 0, 0.5);
  double tilt = 0;
  for (int i = 0; i < 500; ++i) {
    dSpaceCollide(space, 0, touch);
    dWorldQuickStep(world, 0.01);
    dJointGroupEmpty(group);
    tilt = std::fmax(tilt, std::acos(std::fmin(1, dBodyGetRotation(body)[10])));
  }
  const dReal* at = dBodyGetPosition(body);
  return std::hypot(at[0], at[1]) > 1 ? "flies" : tilt > 0.5 ? "topples" : tilt > 0.05 ? "rocks" : "rests";
}

int main() {
  dInitODE2(0);
  dSetMessageHandler([](int, const char*, va_list) {});
  for (const bool on_mesh : {false, true})
    for (const int contacts : {4, 8, 64}) {
      std::printf("on a %s, at most %2d contacts:", on_mesh ? "mesh " : "plane", contacts);
      for (const int cuts : {1, 4, 10, 20}) std::printf("  %d triangles %s", 12 * cuts * cuts, rest(cuts, on_mesh, contacts));
      std::puts("");
    }
}
END
shows <<'END'
on a plane, at most  4 contacts:  12 triangles rests  192 triangles rests  1200 triangles rocks  4800 triangles topples
on a plane, at most  8 contacts:  12 triangles rests  192 triangles rests  1200 triangles rests  4800 triangles rests
on a plane, at most 64 contacts:  12 triangles rests  192 triangles rests  1200 triangles rests  4800 triangles rests
on a mesh , at most  4 contacts:  12 triangles rests  192 triangles flies  1200 triangles flies  4800 triangles topples
on a mesh , at most  8 contacts:  12 triangles rests  192 triangles rests  1200 triangles flies  4800 triangles flies
on a mesh , at most 64 contacts:  12 triangles rests  192 triangles rests  1200 triangles rests  4800 triangles rests
END
