// Bullet's two trees, one of what rests, with ODE's geoms as the proxies' objects. Ray tests visit
// all boxes on the way of a ray.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>

#include "../warehouse_peers.h"
#include "float_boxes.h"

namespace bench {
namespace {

struct Bounds {
  btVector3 low, high;
  explicit Bounds(dGeomID geom) {
    dReal box[6];
    dGeomGetAABB(geom, box);
    low = {floatBelow(box[0]), floatBelow(box[2]), floatBelow(box[4])};
    high = {floatAbove(box[1]), floatAbove(box[3]), floatAbove(box[5])};
  }
};

dGeomID geomOf(const btBroadphaseProxy* proxy) {
  return static_cast<dGeomID>(proxy->m_clientObject);
}

// Calls `near` for a ray or probe and what its box meets.
struct Query : btBroadphaseRayCallback {
  Query(dNearCallback* callback, void* its_data) : near(callback), data(its_data) {}
  dNearCallback* const near;
  void* const data;
  dGeomID geom = nullptr;
  bool process(const btBroadphaseProxy* proxy) override {
    near(data, geom, geomOf(proxy));
    return true;
  }
};

class BulletWarehouse : public scene::Warehouse {
 public:
  explicit BulletWarehouse(const scene::Plan& plan) : Warehouse(plan) {
    enum { Static = 1, Asleep = 2, Awake = 4 };
    for (const dGeomID geom : geoms()) {
      const dBodyID body = dGeomGetBody(geom);
      const int group = !body ? Static : dBodyIsEnabled(body) ? Awake : Asleep;
      const Bounds bounds(geom);
      btBroadphaseProxy* const proxy =
          tree_.createProxy(bounds.low, bounds.high, BOX_SHAPE_PROXYTYPE, geom, group,
                            group == Awake ? Static | Asleep | Awake : Awake, &dispatcher_);
      if (group == Awake) awake_.push_back(proxy);
    }
  }

 private:
  void collide() override {
    for (btBroadphaseProxy* const proxy : awake_) {
      const Bounds bounds(geomOf(proxy));
      tree_.setAabb(proxy, bounds.low, bounds.high, &dispatcher_);
    }
    tree_.calculateOverlappingPairs(&dispatcher_);
    const btBroadphasePairArray& pairs = tree_.getOverlappingPairCache()->getOverlappingPairArray();
    for (int i = 0; i < pairs.size(); ++i) {
      const dGeomID a = geomOf(pairs[i].m_pProxy0), b = geomOf(pairs[i].m_pProxy1);
      if (dGeomGetBody(a) != dGeomGetBody(b)) near(this, a, b);
    }
  }

  void castRays() override {
    Query query(nearRay, this);
    for (std::size_t i = 0; i < rays().size(); ++i) {
      query.geom = aim(i);
      dVector3 from, way;
      dGeomRayGet(query.geom, from, way);
      const auto vector = [](const dReal* at) {
        return btVector3(btScalar(at[0]), btScalar(at[1]), btScalar(at[2]));
      };
      const btVector3 direction = vector(way);
      for (int axis = 0; axis < 3; ++axis) {
        query.m_rayDirectionInverse[axis] =
            direction[axis] == 0 ? BT_LARGE_FLOAT : 1 / direction[axis];
        query.m_signs[axis] = query.m_rayDirectionInverse[axis] < 0;
      }
      query.m_lambda_max = btScalar(rays()[i].length);
      tree_.rayTest(vector(from), vector(from) + query.m_lambda_max * direction, query);
    }
  }

  void tryPoses() override {
    Query query(nearProbe, this);
    for (std::size_t i = 0; i < probes().size(); ++i) {
      query.geom = pose(i);
      const Bounds bounds(query.geom);
      tree_.aabbTest(bounds.low, bounds.high, query);
    }
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase tree_;
  std::vector<btBroadphaseProxy*> awake_;
};

const AddWarehouse<BulletWarehouse> added("bullet-dbvt");

}  // namespace
}  // namespace bench
