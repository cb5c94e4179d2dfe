// ODE's own four spaces.
#include <algorithm>
#include <cmath>

#include "ode_geoms.h"

namespace bench {
namespace {

class SimplePeer : public OdeSpacePeer {
  dSpaceID createSpace(const Extent&, std::size_t) override { return dSimpleSpaceCreate(nullptr); }
};

// With its default levels, as programs use it.
class HashPeer : public OdeSpacePeer {
  dSpaceID createSpace(const Extent&, std::size_t) override { return dHashSpaceCreate(nullptr); }
};

class SweepAndPrunePeer : public OdeSpacePeer {
  dSpaceID createSpace(const Extent&, std::size_t) override {
    return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  }
};

// About four geoms in a leaf: a little deeper or shallower is slower.
class QuadTreePeer : public OdeSpacePeer {
  dSpaceID createSpace(const Extent& extent, std::size_t count) override {
    dVector3 centre, half;
    for (int axis = 0; axis < 3; ++axis) {
      centre[axis] = static_cast<dReal>((extent.low[axis] + extent.high[axis]) / 2);
      half[axis] = static_cast<dReal>((extent.high[axis] - extent.low[axis]) / 2 * 1.1);
    }
    const double leaves = static_cast<double>(count) / 4;
    const int depth =
        static_cast<int>(std::lround(std::log(std::max(leaves, 1.0)) / std::log(4.0)));
    return dQuadTreeSpaceCreate(nullptr, centre, half, std::clamp(depth, 1, 8));
  }
};

template <class Space>
PeerKind kind(const char* name, std::size_t most) {
  PeerKind kind;
  kind.name = name;
  kind.library = odeVersion();
  kind.most = most;
  kind.create = [](int) { return std::make_unique<Space>(); };
  return kind;
}

const AddPeers added([](std::vector<PeerKind>& kinds) {
  // The hash space keeps a table of n * n bits, whose size overflows an int at 131,072 geoms.
  kinds.push_back(kind<HashPeer>("dHashSpace", 120000));
  kinds.back().refuses = [](const Boxes& boxes) -> std::string {
    const Extent extent = extentOf(boxes);
    for (int axis = 0; axis < 3; ++axis)
      if (std::max(-extent.low[axis], extent.high[axis]) > 1e8)
        return "its cells' numbers overflow, which ends the program";
    return "";
  };
  kinds.push_back(kind<SweepAndPrunePeer>("dSweepAndPruneSpace", 1000000));
  kinds.back().superset = "float bounds on one axis";
  kinds.push_back(kind<QuadTreePeer>("dQuadTreeSpace", 300000));
  kinds.push_back(kind<SimplePeer>("dSimpleSpace", 10000));
});

}  // namespace
}  // namespace bench
