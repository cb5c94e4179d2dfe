// FCL's tree, in double precision. It keeps its structure from frame to frame.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/config.h>
#include <fcl/geometry/shape/box.h>

#include "../peer.h"

namespace bench {
namespace {

bool count(fcl::CollisionObjectd*, fcl::CollisionObjectd*, void* data) {
  ++*static_cast<std::size_t*>(data);
  return false;  // go on
}

std::size_t numberOf(const fcl::CollisionObjectd* object) {
  return reinterpret_cast<std::size_t>(object->getUserData());
}

bool tell(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  (*static_cast<const PairVisitor*>(data))(numberOf(a), numberOf(b));
  return false;
}

class FclPeer : public Peer {
 public:
  void create(const Boxes& boxes) override {
    for (const CentredBox& box : boxes) {
      shapes_.push_back(
          std::make_shared<fcl::Boxd>(2 * box.half[0], 2 * box.half[1], 2 * box.half[2]));
      objects_.push_back(std::make_unique<fcl::CollisionObjectd>(shapes_.back()));
      objects_.back()->setUserData(reinterpret_cast<void*>(objects_.size() - 1));
      pointers_.push_back(objects_.back().get());
    }
    move(boxes);
    for (const auto& object : objects_) object->computeAABB();
  }

  void enter() override {
    manager_.registerObjects(pointers_);
    manager_.setup();
  }

  void move(const Boxes& boxes) override {
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      const dReal *centre = boxes[i].centre, *half = boxes[i].half;
      const fcl::Vector3d side(2 * half[0], 2 * half[1], 2 * half[2]);
      if (shapes_[i]->side != side) {
        shapes_[i]->side = side;
        shapes_[i]->computeLocalAABB();
      }
      objects_[i]->setTranslation(fcl::Vector3d(centre[0], centre[1], centre[2]));
    }
  }

  std::size_t find(const PairVisitor* visitor) override {
    for (const auto& object : objects_) object->computeAABB();
    manager_.update();
    std::size_t pairs = 0;
    if (visitor)
      manager_.collide(const_cast<PairVisitor*>(visitor), tell);
    else
      manager_.collide(&pairs, count);
    return pairs;
  }

 private:
  std::vector<std::shared_ptr<fcl::Boxd>> shapes_;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
  std::vector<fcl::CollisionObjectd*> pointers_;
  fcl::DynamicAABBTreeCollisionManagerd manager_;
};

const AddPeer added({"fcl-tree", "FCL " FCL_VERSION,
                     [](int) { return std::make_unique<FclPeer>(); }, "", false, 2000000});

}  // namespace
}  // namespace bench
