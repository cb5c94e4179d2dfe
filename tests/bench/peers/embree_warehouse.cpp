// Embree's hierarchies over the boxes of ODE's geoms: one of what is static, which is built once,
// one of what may move and one of the probes. Rays end at the nearest hit that dCollide finds.
#include <embree3/rtcore.h>

#include <algorithm>

#include "../warehouse_peers.h"
#include "float_boxes.h"

namespace bench {
namespace {

class EmbreeWarehouse : public scene::Warehouse {
 public:
  explicit EmbreeWarehouse(const scene::Plan& plan) : Warehouse(plan) {
    for (const dGeomID geom : geoms()) (dGeomGetBody(geom) ? movers_ : rest_).geoms.push_back(geom);
    for (const dParallelSAPProbe& probe : probes()) probes_.geoms.push_back(probe.geom);
    for (Boxes* const boxes : {&rest_, &movers_, &probes_}) boxes->enter(device_, this);
  }
  ~EmbreeWarehouse() override {
    for (Boxes* const boxes : {&rest_, &movers_, &probes_}) rtcReleaseScene(boxes->scene);
    rtcReleaseDevice(device_);
  }

 private:
  struct Boxes {
    EmbreeWarehouse* warehouse;
    std::vector<dGeomID> geoms;
    RTCScene scene;
    RTCGeometry geometry;

    void enter(RTCDevice device, EmbreeWarehouse* owner) {
      warehouse = owner;
      scene = rtcNewScene(device);
      rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
      rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
      geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
      rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_LOW);
      rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(geoms.size()));
      rtcSetGeometryUserData(geometry, this);
      rtcSetGeometryBoundsFunction(geometry, boundsOf, nullptr);
      rtcSetGeometryIntersectFunction(geometry, meetRay);
      rtcAttachGeometry(scene, geometry);
      rtcReleaseGeometry(geometry);  // the scene holds it
      update();
    }
    void update() {
      rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
      rtcCommitGeometry(geometry);
      rtcCommitScene(scene);
    }
  };

  static void boundsOf(const RTCBoundsFunctionArguments* arguments) {
    constexpr double margin = 1e-4;  // rays are rounded to floats, too
    const dGeomID geom =
        static_cast<const Boxes*>(arguments->geometryUserPtr)->geoms[arguments->primID];
    dReal box[6];
    dGeomGetAABB(geom, box);
    for (int axis = 0; axis < 3; ++axis) {
      (&arguments->bounds_o->lower_x)[axis] = floatBelow(box[2 * axis] - margin);
      (&arguments->bounds_o->upper_x)[axis] = floatAbove(box[2 * axis + 1] + margin);
    }
  }

  static void meetRay(const RTCIntersectFunctionNArguments* arguments) {
    const Boxes& boxes = *static_cast<const Boxes*>(arguments->geometryUserPtr);
    EmbreeWarehouse& self = *boxes.warehouse;
    nearRay(&self, self.ray_, boxes.geoms[arguments->primID]);
    const dParallelSAPRayHit& hit = self.hits()[self.number_];
    if (!hit.geom) return;
    RTCRayHit& found = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    found.ray.tfar = std::min(found.ray.tfar, floatAbove(hit.distance + 1e-4));
    found.hit.geomID = arguments->geomID;
  }

  // Calls meet (number, a, b), with the number of a among the first.
  template <class Meet>
  static void eachPair(const Boxes& first, const Boxes& second, const Meet& meet) {
    struct Call {
      const Boxes *first, *second;
      const Meet& meet;
    } call{&first, &second, meet};
    rtcCollide(
        first.scene, second.scene,
        [](void* data, RTCCollision* collisions, unsigned count) {
          const Call& to = *static_cast<Call*>(data);
          for (unsigned i = 0; i < count; ++i)
            to.meet(collisions[i].primID0, to.first->geoms[collisions[i].primID0],
                    to.second->geoms[collisions[i].primID1]);
        },
        &call);
  }

  void collide() override {
    movers_.update();
    const auto meet = [this](unsigned, dGeomID a, dGeomID b) {
      if (dGeomGetBody(a) != dGeomGetBody(b)) near(this, a, b);
    };
    eachPair(movers_, rest_, meet);
    eachPair(movers_, movers_, [&](unsigned, dGeomID a, dGeomID b) {
      if (a < b) meet(0, a, b);  // a pair comes in both orders
    });
  }

  void castRays() override {
    for (number_ = 0; number_ < rays().size(); ++number_) {
      ray_ = aim(number_);
      dVector3 from, way;
      dGeomRayGet(ray_, from, way);
      RTCRayHit ray = {};
      for (int axis = 0; axis < 3; ++axis) {
        (&ray.ray.org_x)[axis] = static_cast<float>(from[axis]);
        (&ray.ray.dir_x)[axis] = static_cast<float>(way[axis]);
      }
      ray.ray.tfar = floatAbove(rays()[number_].length);
      ray.ray.mask = ~0u;
      ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      for (const Boxes* const boxes : {&movers_, &rest_}) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(boxes->scene, &context, &ray);
      }
    }
  }

  void tryPoses() override {
    probes_.update();
    for (std::size_t i = 0; i < probes().size(); ++i) pose(i);  // not touched so far
    for (const Boxes* const boxes : {&rest_, &movers_})
      eachPair(probes_, *boxes, [this](unsigned number, dGeomID a, dGeomID b) {
        if (probes()[number].touched) return;
        pose(number);
        nearProbe(this, a, b);
      });
  }

  const RTCDevice device_ = rtcNewDevice("threads=1");
  Boxes rest_, movers_, probes_;
  dGeomID ray_ = nullptr;
  std::size_t number_ = 0;
};

const AddWarehouse<EmbreeWarehouse> added("embree");

}  // namespace
}  // namespace bench
