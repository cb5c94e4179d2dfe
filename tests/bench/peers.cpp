#include "peer.h"

namespace bench {

const std::vector<PeerKind>& peerKinds() {
  static const std::vector<PeerKind> kinds = [] {
    std::vector<PeerKind> all;
    addParallelSapPeers(all);
    addOdePeers(all);
#ifdef BENCH_EMBREE
    addEmbreePeers(all);
#endif
#ifdef BENCH_CGAL
    addCgalPeers(all);
#endif
#ifdef BENCH_BULLET
    addBulletPeers(all);
#endif
#ifdef BENCH_FCL
    addFclPeers(all);
#endif
#ifdef BENCH_PHYSX
    addPhysXPeers(all);
#endif
#ifdef BENCH_JOLT
    addJoltPeers(all);
#endif
#ifdef BENCH_BOX3D
    addBox3dPeers(all);
#endif
#ifdef BENCH_SCALABLE_CCD
    addScalableCcdPeers(all);
#endif
    return all;
  }();
  return kinds;
}

}  // namespace bench
