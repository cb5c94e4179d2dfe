// Whose trees queries walk. These tests see ODE's private headers.
#include "space/base/round_to_floats.h"
#include "space/geoms/geom_tests.h"
#include "space/queries/geom_tree.h"
#include "support/tests.h"

using namespace sap_test;
using namespace ode_parallel_sap;

TEST_CASE("Queries take the trees of a sweep, unless that is of little use") {
  GeomTree::Geoms geoms;
  BoxSet boxes;
  for (int i = 0; i < 1000; ++i) {
    geoms.push_back(dCreateSphere(nullptr, real(0.5)));
    dGeomSetPosition(geoms[i], i % 32, i / 32, 0);
    cleanGeom(geoms[i]);
    boxes.boxes.push_back({});
    roundToFloats(geoms[i]->aabb, boxes.boxes[i]);
  }
  boxes.size = geoms.size();
  Sweep<float> sweep;
  GeomTree tree;
  PairList pairs;
  const auto takes = [&](std::size_t queries, std::size_t moved, std::size_t left_out = 0) {
    for (Slot slot = 0; slot < geoms.size(); ++slot) tree.changed(slot);
    sweep.find(boxes, 1, pairs);
    const void* const cells = sweep.trees().views()->levels[0];
    tree.takeFrom(sweep, geoms, left_out);
    for (Slot slot = 0; slot < moved; ++slot) tree.changed(slot);
    return tree.bringUpToDate(geoms, 1, queries) && tree.withTrees([&](const auto& of) {
      return of[GeomTree::bounded].count() > 0 && of[GeomTree::bounded].views()->levels[0] == cells;
    });
  };
  CHECK_FALSE(takes(5, 0));
  CHECK(takes(5, 0));
  CHECK(takes(5, 10));
  CHECK(takes(5, geoms.size()));
  CHECK_FALSE(takes(5, 0));  // that was of no use
  CHECK_FALSE(takes(5, 0));
  CHECK(takes(1, 0));  // as many as before are likely
  CHECK(takes(1, 0));
  CHECK_FALSE(takes(1, 0));
  CHECK_FALSE(takes(5, 0));
  CHECK(takes(5, 0));
  CHECK_FALSE(takes(5, 0, 100));
  CHECK(takes(5, 0));
  while (!tree.noteFrame()) continue;
  CHECK_FALSE(takes(5, 0));
  const auto addPlanes = [&](std::size_t count) {  // of the other kind
    for (; count > 0; --count) {
      geoms.push_back(dCreatePlane(nullptr, 0, 0, 1, 0));
      boxes.boxes.push_back(inactiveBox<float>());
    }
    boxes.size = geoms.size();
  };
  addPlanes(1);
  for (int i = 0; i < 3000; ++i) takes(5, 0);  // each goes through a row of strays
  CHECK(takes(5, 0));
  addPlanes(1500);
  takes(20, 0);  // and builds others where they were
  for (int i = 0; i < 4; ++i) CHECK_FALSE(takes(20, 0));
  for (const dGeomID geom : geoms) dGeomDestroy(geom);
}
