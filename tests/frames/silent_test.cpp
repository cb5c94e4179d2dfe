// Meshes whose triangles change without a word to any space: dGeomTriMeshSetData tells none.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <algorithm>
#include <array>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/knobs.h"
#include "support/random.h"
#include "support/recorder.h"
#include "support/scenes.h"

using namespace sap_test;

namespace {

constexpr std::size_t kProbeNumber = 1000000;
constexpr std::size_t kPlaces = 8;

// Where the triangle of data number `place` is: from x to x + 1. Boxes of denseCube() are not
// there.
double xOf(std::size_t place) {
  return 100 + 10 * static_cast<double>(place);
}

// One triangle at each place.
class Triangles {
 public:
  Triangles() {
    static const dTriIndex indices[] = {0, 1, 2};
    for (std::size_t place = 0; place < kPlaces; ++place) {
      const double x = xOf(place);
      vertices_[place] = {x, 0, 0, x + 1, 0, 0, x, 1, 1};
      data_[place] = dGeomTriMeshDataCreate();
      dGeomTriMeshDataBuildDouble(data_[place], vertices_[place].data(), 3 * sizeof(double), 3,
                                  indices, 3, 3 * sizeof(dTriIndex));
    }
  }
  ~Triangles() {
    for (const dTriMeshDataID data : data_) dGeomTriMeshDataDestroy(data);
  }
  Triangles(const Triangles&) = delete;
  Triangles& operator=(const Triangles&) = delete;

  dTriMeshDataID at(std::size_t place) const { return data_[place]; }
  dGeomID create(dSpaceID space, std::size_t place) const {
    return dCreateTriMesh(space, data_[place], nullptr, nullptr, nullptr);
  }

 private:
  std::array<std::array<double, 9>, kPlaces> vertices_;
  std::array<dTriMeshDataID, kPlaces> data_;
};

// The space in which a mesh is put, and what of it the outer space reports.
struct Holder {
  const char* name;
  dSpaceID (*outermost)(dSpaceID parent);  // null: the outer space itself
  dSpaceID (*innermost)(dSpaceID parent);  // null: that
};
const Holder kHolders[] = {{"none", nullptr, nullptr},
                           {"simple", dSimpleSpaceCreate, nullptr},
                           {"hash", dHashSpaceCreate, nullptr},
                           {"ours", dParallelSAPSpaceCreate, nullptr},
                           {"simple in hash", dHashSpaceCreate, dSimpleSpaceCreate},
                           {"simple in ours", dParallelSAPSpaceCreate, dSimpleSpaceCreate},
                           {"ours in simple", dSimpleSpaceCreate, dParallelSAPSpaceCreate},
                           {"ours in ours", dParallelSAPSpaceCreate, dParallelSAPSpaceCreate}};

std::vector<std::size_t> numbersAt(dSpaceID space, std::size_t place) {
  const dGeomID probe = dCreateBox(nullptr, 2, 2, 2);
  dGeomSetPosition(probe, static_cast<dReal>(xOf(place) + 0.5), 0, 0);
  setNumber(probe, kProbeNumber);
  std::vector<std::size_t> numbers;
  for (const Pair& pair : collide2(space, probe)) numbers.push_back(pair.first);
  dGeomDestroy(probe);
  return numbers;
}

}  // namespace

TEST_CASE("A mesh with other triangles pairs where these are, in whatever space it is",
          "[silent]") {
  const Triangles triangles;
  for (const Configuration& configuration : configurations())
    for (const Holder& holder : kHolders)
      for (const std::size_t n : {0, 300, 1500}) {
        const Space space(configuration);
        World world(space);
        world.addBoxes(denseCube(n, 2));
        const dSpaceID outermost = holder.outermost ? holder.outermost(space) : dSpaceID(space);
        const dSpaceID innermost = holder.innermost ? holder.innermost(outermost) : outermost;
        const dGeomID mesh = triangles.create(innermost, 0);
        setNumber(outermost == space ? mesh : asGeom(outermost), kProbeNumber);
        for (std::size_t place = 0; place < kPlaces; ++place) {
          const dGeomID box = world.take(dCreateBox(space, 2, 2, 2));
          dGeomSetPosition(box, static_cast<dReal>(xOf(place)), 0, 0);
        }
        const auto partners = [&] {
          std::vector<std::size_t> partners;
          for (const Pair& pair : collide(space))
            if (pair.first == kProbeNumber) partners.push_back(pair.second - n);
          return partners;
        };
        for (int frame = 0; frame < 4; ++frame) REQUIRE(partners() == std::vector<std::size_t>{0});
        for (std::size_t round = 1; round < 2 * kPlaces; ++round) {
          INFO(configuration.name << ", in " << holder.name << ", " << n << " boxes, round "
                                  << round);
          const std::size_t place = round * 3 % kPlaces;
          dGeomTriMeshSetData(mesh, triangles.at(place));
          if (round % 3 == 1 && dSpaceIsParallelSAP(innermost)) dSpaceClean(innermost);
          CHECK(partners() == std::vector<std::size_t>{place});
          CHECK(partners() == std::vector<std::size_t>{place});
        }
      }
}

TEST_CASE("Spaces are asked for the meshes they hold as these come and go", "[silent]") {
  const std::uint64_t seed = seedOr(301);
  INFO("ODE_PARALLEL_SAP_TEST_SEED=" << seed);
  const Triangles triangles;
  Random random(seed);
  const Space space;
  struct Model {
    dSpaceID outermost, innermost;
    std::vector<std::pair<dGeomID, std::size_t>> meshes;  // with their places
    std::size_t number;
  };
  std::vector<Model> models;
  std::size_t numbers = 0;
  const auto edit = [&] {
    Model* const model = models.empty() ? nullptr : &models[random.below(models.size())];
    const std::size_t place = random.below(kPlaces);
    switch (random.below(model ? 7 : 1)) {
      case 0: {
        const Holder& holder = kHolders[1 + random.below(7)];
        const dSpaceID outermost = holder.outermost(space);
        setNumber(asGeom(outermost), ++numbers);
        models.push_back(
            {outermost, holder.innermost ? holder.innermost(outermost) : outermost, {}, numbers});
        break;
      }
      case 1:
      case 2:
        model->meshes.emplace_back(triangles.create(model->innermost, place), place);
        break;
      case 3:
        if (random.chance(0.7)) break;
        dSpaceDestroy(model->outermost);
        models.erase(models.begin() + (model - models.data()));
        break;
      case 4:
        if (model->meshes.empty()) break;
        dGeomDestroy(model->meshes.back().first);
        model->meshes.pop_back();
        break;
      default:
        if (model->meshes.empty()) break;
        std::pair<dGeomID, std::size_t>& mesh = model->meshes[random.below(model->meshes.size())];
        dGeomTriMeshSetData(mesh.first, triangles.at(mesh.second = place));
    }
  };
  const auto reaches = [](const Model& model, std::size_t place) {
    if (model.meshes.empty()) return false;
    const auto [least, most] =
        std::minmax_element(model.meshes.begin(), model.meshes.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
    return least->second <= place && place <= most->second;
  };
  const int edits = scaled(4000);
  for (int i = 0; i < edits; ++i) {
    edit();
    if (random.chance(0.4)) continue;
    if (random.chance(0.1)) (void)collide(space);
    if (random.chance(0.1)) dSpaceClean(space);
    if (random.chance(0.2) && !models.empty() && dSpaceIsParallelSAP(models.back().innermost))
      dSpaceClean(models.back().innermost);
    const std::size_t place = random.below(kPlaces);
    std::vector<std::size_t> expected;
    for (const Model& model : models)
      if (reaches(model, place)) expected.push_back(model.number);
    INFO("edit " << i);
    REQUIRE(numbersAt(space, place) == expected);
  }
}
