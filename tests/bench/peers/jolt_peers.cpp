// Jolt's quad tree of one layer, in the order of its own step: pairs of active bodies are found in
// a tree whose boxes were widened by what moved, while the next tree is built beside that. It keeps
// no pairs.
#include <Jolt/Jolt.h>
// Jolt's own headers want that one first.
#include <Jolt/Core/Factory.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Body/BodyManager.h>
#include <Jolt/Physics/Body/BodyPair.h>
#include <Jolt/Physics/Collision/BroadPhase/BroadPhaseLayerInterfaceTable.h>
#include <Jolt/Physics/Collision/BroadPhase/BroadPhaseQuadTree.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/RegisterTypes.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "float_boxes.h"

namespace bench {
namespace {

// What Jolt wants of its user once a process, before anything of it is constructed.
void initialise() {
  static const bool done = [] {
    JPH::RegisterDefaultAllocator();
    JPH::Factory::sInstance = new JPH::Factory;
    JPH::RegisterTypes();
    return true;
  }();
  static_cast<void>(done);
}

// As many bodies at a time as PhysicsSystem takes (its cActiveBodiesBatchSize).
constexpr int batch = 16;

// Counts pairs, and hands them on if there is a visitor.
struct Collector : JPH::BodyPairCollector {
  explicit Collector(const PairVisitor* its_visitor) : visitor(its_visitor) {}
  void AddHit(const JPH::BodyPair& pair) override {
    ++count;
    if (visitor) (*visitor)(pair.mBodyA.GetIndex(), pair.mBodyB.GetIndex());
  }
  const PairVisitor* const visitor;
  std::size_t count = 0;
};

// All bodies are of one layer, and may collide.
struct Layers {
  Layers() : broad(1, 1) { broad.MapObjectToBroadPhaseLayer(0, JPH::BroadPhaseLayer(0)); }
  JPH::BroadPhaseLayerInterfaceTable broad;
  JPH::ObjectLayerPairFilter pairs;
  JPH::ObjectVsBroadPhaseLayerFilter objects;
};

class JoltPeer : public FloatPeer {
 public:
  // `sleeps`: what has not moved sleeps, and pairs of sleepers are not found.
  JoltPeer(int threads, bool sleeps) : threads_(threads), sleeps_(sleeps) {}

  ~JoltPeer() override {
    if (!ids_.empty()) bodies_.DestroyBodies(ids_.data(), static_cast<int>(ids_.size()));
  }

  void create(const Boxes& boxes) override {
    FloatPeer::create(boxes);
    const JPH::uint count = static_cast<JPH::uint>(boxes.size());
    bodies_.Init(count, 0, layers_.broad);
    const JPH::Ref<JPH::Shape> shape = new JPH::SphereShape(1);
    for (JPH::uint i = 0; i < count; ++i) {
      JPH::Body* const body = bodies_.AllocateBody(JPH::BodyCreationSettings(
          shape, JPH::RVec3::sZero(), JPH::Quat::sIdentity(), JPH::EMotionType::Dynamic, 0));
      bodies_.AddBody(body);
      setBounds(i, body);
      ids_.push_back(body->GetID());
    }
  }

  void enter() override {
    // Not before: one that was not initialised cannot be destroyed.
    tree_ = std::make_unique<JPH::BroadPhaseQuadTree>();
    tree_->Init(&bodies_, layers_.broad);
    std::vector<JPH::BodyID> ids = ids_;
    const int count = static_cast<int>(ids.size());
    const JPH::BroadPhase::AddState state = tree_->AddBodiesPrepare(ids.data(), count);
    tree_->AddBodiesFinalize(ids.data(), count, state);
    tree_->Optimize();
    bodies_.ActivateBodies(ids_.data(), count);
  }

  void move(const Boxes& boxes) override {
    FloatPeer::move(boxes);
    moved_ids_.clear();
    for (const auto i : moved_) {
      setBounds(i, &bodies_.GetBody(ids_[i]));
      moved_ids_.push_back(ids_[i]);
    }
    if (!sleeps_) return;
    bodies_.DeactivateBodies(ids_.data(), static_cast<int>(ids_.size()));
    bodies_.ActivateBodies(moved_ids_.data(), static_cast<int>(moved_ids_.size()));
  }

  // The part of PhysicsSystem::Update that concerns the broad phase.
  std::size_t find(const PairVisitor* visitor) override {
    std::mutex mutex;  // of the visitor
    std::atomic<std::size_t> pairs{0};
    tree_->FrameSync();
    tree_->LockModifications();
    notify();
    const JPH::BodyID* const active = bodies_.GetActiveBodiesUnsafe(JPH::EBodyType::RigidBody);
    const int count = static_cast<int>(bodies_.GetNumActiveBodies(JPH::EBodyType::RigidBody));
    JPH::BroadPhase::UpdateState state;
#pragma omp parallel num_threads(threads_)
    {
#pragma omp single nowait
      state = tree_->UpdatePrepare();
#pragma omp for schedule(dynamic)
      for (int first = 0; first < count; first += batch) {
        JPH::BodyID ids[batch];
        const int some = std::min(batch, count - first);
        std::copy_n(active + first, some, ids);
        std::unique_lock<std::mutex> lock(mutex, std::defer_lock);
        if (visitor) lock.lock();
        Collector collector(visitor);
        tree_->FindCollidingPairs(ids, some, 0, layers_.objects, layers_.pairs, collector);
        pairs.fetch_add(collector.count, std::memory_order_relaxed);
      }
    }
    tree_->UpdateFinalize(state);
    tree_->UnlockModifications();
    return pairs;
  }

 private:
  // A body has the bounds of its shape; here it is handed finished ones, as every library is.
  void setBounds(std::size_t number, JPH::Body* body) {
    const FloatBox& box = bounds_[number];
    const_cast<JPH::AABox&>(body->GetWorldSpaceBounds()) =
        JPH::AABox(JPH::Vec3(box.low[0], box.low[1], box.low[2]),
                   JPH::Vec3(box.high[0], box.high[1], box.high[2]));
  }

  void notify() {
    const int count = static_cast<int>(moved_ids_.size());
#pragma omp parallel for schedule(dynamic) num_threads(threads_)
    for (int first = 0; first < count; first += batch)
      tree_->NotifyBodiesAABBChanged(moved_ids_.data() + first, std::min(batch, count - first),
                                     false);
    moved_ids_.clear();
  }

  const int threads_;
  const bool sleeps_;
  Layers layers_;
  JPH::BodyManager bodies_;
  std::unique_ptr<JPH::BroadPhaseQuadTree> tree_;
  std::vector<JPH::BodyID> ids_, moved_ids_;
};

PeerKind kind(const char* name, bool sleeps) {
  PeerKind kind = {name,
                   "Jolt " + std::to_string(JPH_VERSION_MAJOR) + "." +
                       std::to_string(JPH_VERSION_MINOR) + "." + std::to_string(JPH_VERSION_PATCH) +
                       ", float",
                   [sleeps](int threads) {
                     initialise();
                     return std::make_unique<JoltPeer>(threads, sleeps);
                   },
                   "float bounds", true};
  kind.leaves_out_rest = sleeps;
  return kind;
}

const AddPeer awake(kind("jolt", false)), asleep(kind("jolt-asleep", true));

}  // namespace
}  // namespace bench
