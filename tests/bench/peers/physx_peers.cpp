// PhysX's broad phases on the CPU, called as its scene calls them. They keep a set of pairs and
// tell what began and what ended; so does a find here, and it hands over nothing that lasts.
#include <BpBroadPhase.h>
#include <PxcScratchAllocator.h>

#include <stdexcept>

#include "extensions/PxDefaultAllocator.h"
#include "extensions/PxDefaultCpuDispatcher.h"
#include "float_boxes.h"
#include "foundation/PxErrorCallback.h"
#include "foundation/PxFoundation.h"
#include "foundation/PxPhysicsVersion.h"
#include "foundation/PxSync.h"
#include "known_pairs.h"
#include "task/PxTask.h"

namespace bench {
namespace {

using namespace physx;

class Errors : public PxErrorCallback {
  void reportError(PxErrorCode::Enum, const char* message, const char*, int) override {
    throw std::runtime_error(std::string("PhysX: ") + message);
  }
};

// What PhysX wants of its user once a process, before anything of it is constructed.
Errors& errors() {
  static Errors errors;
  static PxDefaultAllocator allocator;
  static PxFoundation* const foundation = PxCreateFoundation(PX_PHYSICS_VERSION, allocator, errors);
  if (!foundation) throw std::runtime_error("PhysX: no foundation");
  return errors;
}

template <class T>
struct Release {
  void operator()(T* object) const { object->release(); }
};
template <class T>
using Owned = std::unique_ptr<T, Release<T>>;

// Comes last of an update's tasks.
class LastTask : public PxLightCpuTask {
 public:
  void run() override {}
  const char* getName() const override { return "last"; }
  void release() override {
    PxLightCpuTask::release();
    done_.set();
  }
  void wait() {
    done_.wait();
    done_.reset();
  }

 private:
  PxSync done_;
};

class PhysXPeer : public FloatPeer {
 public:
  PhysXPeer(PxBroadPhaseType::Enum type, int threads) : type_(type), filter_(false, false) {
    if (threads == 1) return;
    dispatcher_.reset(PxDefaultCpuDispatcherCreate(static_cast<PxU32>(threads)));
    tasks_.reset(PxTaskManager::createTaskManager(errors(), dispatcher_.get()));
  }

  void enter() override {
    const PxU32 count = static_cast<PxU32>(bounds_.size());
    broad_phase_.reset(Bp::BroadPhase::create(type_, 256, 0, 0, 0, 0));
    for (PxU32 i = 0; i < count; ++i) {
      groups_.push_back(Bp::getFilterGroup_Dynamics(i, false));
      all_.push_back(i);
    }
    distances_.assign(count + 1, 0);
    update(all_, {});
  }

  std::size_t find(const PairVisitor* visitor) override {
    broad_phase_->freeBuffers();
    update({}, moved_);
    moved_.clear();
    if (visitor) known_.tellAll(*visitor);
    return known_.count();
  }

 private:
  using Handles = std::vector<Bp::ShapeHandle>;

  void update(const Handles& created, const Handles& moved) {
    static_assert(sizeof(PxBounds3) == sizeof(FloatBox), "both are six floats");
    const Bp::BroadPhaseUpdateData data(created.data(), static_cast<PxU32>(created.size()),
                                        moved.data(), static_cast<PxU32>(moved.size()), nullptr, 0,
                                        reinterpret_cast<const PxBounds3*>(bounds_.data()),
                                        groups_.data(), distances_.data(),
                                        static_cast<PxU32>(groups_.size()), filter_, true, true);
    broad_phase_->preBroadPhase(data);
    if (tasks_) {
      last_.setContinuation(*tasks_, nullptr);
      broad_phase_->update(&scratch_, data, &last_);
      last_.removeReference();
      last_.wait();
    } else {
      broad_phase_->update(&scratch_, data, nullptr);
    }
    broad_phase_->fetchBroadPhaseResults();
    PxU32 begun, ended;
    const Bp::BroadPhasePair* const created_pairs = broad_phase_->getCreatedPairs(begun);
    const Bp::BroadPhasePair* const deleted_pairs = broad_phase_->getDeletedPairs(ended);
    known_.follow(created_pairs, begun, deleted_pairs, ended, [](const Bp::BroadPhasePair& pair) {
      return std::pair<std::size_t, std::size_t>(pair.mVolA, pair.mVolB);
    });
  }

  const PxBroadPhaseType::Enum type_;
  Bp::BpFilter filter_;
  Owned<PxDefaultCpuDispatcher> dispatcher_;
  Owned<PxTaskManager> tasks_;
  LastTask last_;
  PxcScratchAllocator scratch_;
  Owned<Bp::BroadPhase> broad_phase_;
  std::vector<Bp::FilterGroup::Enum> groups_;
  std::vector<float> distances_;
  Handles all_;
  KnownPairs known_;
};

PeerKind kind(const char* name, PxBroadPhaseType::Enum type) {
  return {name,
          "PhysX " + std::to_string(PX_PHYSICS_VERSION_MAJOR) + "." +
              std::to_string(PX_PHYSICS_VERSION_MINOR) + "." +
              std::to_string(PX_PHYSICS_VERSION_BUGFIX) + ", float",
          [type](int threads) {
            errors();
            return std::make_unique<PhysXPeer>(type, threads);
          },
          "float bounds", type == PxBroadPhaseType::ePABP};
}

const AddPeer abp(kind("physx-abp", PxBroadPhaseType::eABP)),
    pabp(kind("physx-pabp", PxBroadPhaseType::ePABP)),
    sap(kind("physx-sap", PxBroadPhaseType::eSAP));

}  // namespace
}  // namespace bench
