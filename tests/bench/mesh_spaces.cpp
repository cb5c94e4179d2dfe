// Boxes of meshes in this project's space, as a program would have them: geoms of a class of its
// own, and category bits where two groups meet.
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>

#include "counting.h"
#include "mesh_finder.h"
#include "user_box.h"

namespace bench {
namespace {

enum class Variant { plain, mirrored, concurrent_blocks };

constexpr unsigned long bits_of_group[] = {1, 2};

sap_test::Bounds boundsOf(const MeshBox& box) {
  sap_test::Bounds bounds;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bounds[2 * axis] = static_cast<dReal>(box.lower[axis]);
    bounds[2 * axis + 1] = static_cast<dReal>(box.upper[axis]);
  }
  return bounds;
}

// A dParallelSAPPairsCallback; `pairs` points to a std::atomic<std::size_t>.
void countBlock(void* pairs, const dParallelSAPPair*, size_t count, size_t) {
  static_cast<std::atomic<std::size_t>*>(pairs)->fetch_add(count, std::memory_order_relaxed);
}

// Geoms that are moved to where they are, or each to the other side of x = 0: no less exact, the
// same pairs, and nothing of the last frame is where it was.
class Geoms {
 public:
  void add(dSpaceID space, const MeshBoxes& boxes) {
    for (const MeshBox& box : boxes)
      geoms_.push_back(sap_test::createUserBoxWithoutTest(space, boundsOf(box)));
    if (!geoms_.empty()) dParallelSAPClassHasNoAABBTest(dGeomGetClass(geoms_.front()));
  }
  void move() {
    for (const dGeomID geom : geoms_) dGeomSetPosition(geom, 0, 0, 0);
  }
  void mirror() {
    for (const dGeomID geom : geoms_) {
      sap_test::Bounds bounds = sap_test::userBoxData(geom).bounds;
      const dReal lower = bounds[0];
      bounds[0] = -bounds[1];
      bounds[1] = -lower;
      sap_test::setUserBounds(geom, bounds);
    }
  }
  const std::vector<dGeomID>& all() const { return geoms_; }

 private:
  std::vector<dGeomID> geoms_;
};

// One space; where there are two groups, geoms of the same group have no bits for each other.
class SpaceFinder : public MeshFinder {
 public:
  SpaceFinder(const MeshBoxes& a, const MeshBoxes* b, int threads, Variant variant)
      : variant_(variant), space_(dParallelSAPSpaceCreate(nullptr)) {
    dParallelSAPSpaceSetBackend(space_, dParallelSAPBackendCPU);
    dParallelSAPSpaceSetNumThreads(space_, threads);
    geoms_.add(space_, a);
    if (!b) return;
    geoms_.add(space_, *b);
    for (std::size_t i = 0; i < geoms_.all().size(); ++i) {
      const bool second = i >= a.size();
      dGeomSetCategoryBits(geoms_.all()[i], bits_of_group[second]);
      dGeomSetCollideBits(geoms_.all()[i], bits_of_group[!second]);
    }
  }
  ~SpaceFinder() override { dSpaceDestroy(space_); }

  void move() override { variant_ == Variant::mirrored ? geoms_.mirror() : geoms_.move(); }
  std::size_t find() override {
    if (variant_ != Variant::concurrent_blocks) {
      std::size_t pairs = 0;
      dSpaceCollide(space_, &pairs, countPair);
      return pairs;
    }
    std::atomic<std::size_t> pairs{0};
    dParallelSAPSpaceCollidePairs(space_, &pairs, dParallelSAPPairsConcurrent, countBlock);
    return pairs;
  }
  double extraction() const override {
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(space_, &stats);
    return stats.extract_ms;
  }

 private:
  const Variant variant_;
  const dSpaceID space_;
  Geoms geoms_;
};

// A space for each group, and dSpaceCollide2.
class TwoSpacesFinder : public MeshFinder {
 public:
  TwoSpacesFinder(const MeshBoxes& a, const MeshBoxes& b, int threads) {
    for (dSpaceID& space : spaces_) {
      space = dParallelSAPSpaceCreate(nullptr);
      dParallelSAPSpaceSetBackend(space, dParallelSAPBackendCPU);
      dParallelSAPSpaceSetNumThreads(space, threads);
    }
    geoms_.add(spaces_[0], a);
    geoms_.add(spaces_[1], b);
  }
  ~TwoSpacesFinder() override {
    for (const dSpaceID space : spaces_) dSpaceDestroy(space);
  }
  void move() override { geoms_.move(); }
  std::size_t find() override {
    std::size_t pairs = 0;
    dSpaceCollide2(reinterpret_cast<dGeomID>(spaces_[0]), reinterpret_cast<dGeomID>(spaces_[1]),
                   &pairs, countPair);
    return pairs;
  }

 private:
  dSpaceID spaces_[2];
  Geoms geoms_;
};

template <Variant variant>
std::unique_ptr<MeshFinder> createSpace(const MeshBoxes& a, const MeshBoxes* b, int threads) {
  return std::make_unique<SpaceFinder>(a, b, threads, variant);
}

std::unique_ptr<MeshFinder> createTwoSpaces(const MeshBoxes& a, const MeshBoxes* b, int threads) {
  return std::make_unique<TwoSpacesFinder>(a, *b, threads);
}

}  // namespace

void addSpaceFinders(std::vector<MeshFinderKind>& kinds) {
  const std::string library = "ode-parallel-sap " BENCH_PROJECT_VERSION;
  kinds.push_back({"parallel-sap", library, false, createSpace<Variant::plain>});
  kinds.push_back({"parallel-sap:mirrored", library, false, createSpace<Variant::mirrored>});
  kinds.push_back(
      {"parallel-sap:concurrent-blocks", library, false, createSpace<Variant::concurrent_blocks>});
  kinds.push_back({"parallel-sap:two-spaces", library, true, createTwoSpaces});
}

}  // namespace bench
