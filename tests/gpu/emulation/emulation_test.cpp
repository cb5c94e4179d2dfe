// The kernels and all that drives them, on emulated devices: any number of devices finds the pairs
// of the CPU's sweep in its order, whatever is done before what, and leaves nothing behind.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cuda/check/scenes.h"
#include "cuda/device/devices.h"
#include "cuda/device/fault_injection.h"
#include "cuda/finder/device_pool.h"
#include "cuda/several/device_group.h"
#include "space/pairs/sweep.h"
#include "support/case.h"
#include "support/catch.hpp"
#include "support/knobs.h"
#include "support/random.h"
#include "tests/gpu/emulation/runtime.h"

using namespace ode_parallel_sap;
using sap_test::Random;

namespace {

// Scenes that change from frame to frame: another one, one in which some boxes have moved or most
// are inverted, or the same boxes nearer to or further from each other, which changes the length of
// lists.
class ChangingScene {
 public:
  explicit ChangingScene(Random& random) : random_(random) { begin(); }

  const BoxSet& boxes() const { return boxes_; }
  const std::string& name() const { return name_; }

  void fill(const std::string& name, std::size_t size) {
    name_ = name;
    cuda_check::sceneOf(name).fill(size, random_.bits(), boxes_);
  }

  void change() {
    const std::size_t what = random_.below(5);
    if (what == 0) begin();
    if (what == 1) move();
    if (what == 2) stretch();
    if (what == 3) invert();
  }

 private:
  void begin() {
    const std::vector<cuda_check::Scene>& all = cuda_check::scenes();
    const cuda_check::Scene& scene = all[random_.below(all.size())];
    // Around the sizes of warps and of blocks of lists; few enough for scenes in which all meet.
    const std::size_t sizes[] = {2, 3, 31, 33, 64, 255, 256, 257, 300, 511, 513, 700};
    std::size_t size = sizes[random_.below(sizeof sizes / sizeof *sizes)];
    if (random_.chance(0.3)) size = 2 + random_.below(900);
    fill(scene.name, std::min(size, scene.most));
  }
  void move() {
    for (std::size_t i = 0; i < boxes_.size; ++i) {
      const auto by = static_cast<float>(random_.between(-0.05, 0.05));
      if (random_.chance(0.5)) shift(boxes_.boxes[i], [=](float centre) { return centre + by; });
    }
  }
  void stretch() {
    const float factors[] = {0.3f, 0.5f, 0.7f, 1.5f, 3, 10};
    const float factor = factors[random_.below(6)];
    for (std::size_t i = 0; i < boxes_.size; ++i)
      shift(boxes_.boxes[i], [=](float centre) { return centre * factor; });
  }
  void invert() {
    const std::size_t axis = random_.below(3);
    for (std::size_t i = 0; i < boxes_.size; ++i)
      if (random_.chance(0.95)) std::swap(boxes_.boxes[i].lower[axis], boxes_.boxes[i].upper[axis]);
  }
  template <class Place>
  static void shift(Box& box, Place place) {
    for (int axis = 0; axis < 3; ++axis) {
      const float centre = 0.5f * (box.lower[axis] + box.upper[axis]);
      const float half = 0.5f * (box.upper[axis] - box.lower[axis]), now = place(centre);
      // In a BoxSet all bounds are NaN or none is, and none is infinite.
      if (!std::isfinite(now - half) || !std::isfinite(now + half)) continue;
      box.lower[axis] = now - half;
      box.upper[axis] = now + half;
    }
  }

  Random& random_;
  BoxSet boxes_;
  std::string name_;
};

// What has happened in a test, which would show nothing otherwise.
struct Seen {
  int frames = 0, shared = 0, failures = 0, within_rows = 0, beyond_rows = 0;
  int pieces = 0;  // of boxes that came before find()
};

// Some members, each a device of its own or not, and a scene, for some frames. How many goes by the
// number of the run, so that a few have all there is.
class Run {
 public:
  Run(std::uint64_t seed, int number, double failing, Seen& seen)
      : random_(seed), scene_(random_), failing_(failing), seen_(seen) {
    emulation::random() = Random(random_.bits());
    emulation::settings().kernels_run = true;
    const std::size_t most = number % 4 == 3 ? 1 : 2 + random_.below(random_.chance(0.5) ? 3 : 15);
    const std::size_t members_a_device = 1 + number / 3 % 3;
    for (std::size_t i = 0; i < most; ++i)
      members_.push_back(std::make_unique<DeviceSweep>(static_cast<int>(i / members_a_device)));
    used_ = most;
  }

  void frame() {
    if (random_.chance(0.25)) used_ = 1 + random_.below(members_.size());
    show();
    scene_.change();
  }

  // On all devices, a scene for rows, which are as long as it needs in its second frame, and one
  // whose lists are too long for them. Then gives all back.
  void end() {
    used_ = members_.size();
    scene_.fill("cube", 600);
    show();
    show();
    scene_.fill("same spot", 64);
    show();
    members_.clear();
    REQUIRE(emulation::pending() == 0);
    REQUIRE(emulation::memoryHeld() == 0);
  }

 private:
  void show() {
    std::vector<DeviceSweep*> used;
    for (std::size_t i = 0; i < used_; ++i) used.push_back(members_[i].get());
    emulation::shuffleStreams();
    INFO(scene_.name() << ", " << scene_.boxes().size << " boxes, " << used_ << " of "
                       << members_.size() << " devices");
    if (find(used)) check(used);
  }

  bool find(const std::vector<DeviceSweep*>& used) {
    const bool failing = random_.chance(failing_);
    if (failing) failCudaCall(1 + random_.below(120 * used_));
    // Some may be had only once others were brought boxes.
    std::vector<DeviceSweep*> now = used;
    if (random_.chance(0.2)) now.resize(1 + random_.below(used.size()));
    try {
      bringSome(now);
      now = used;
      DeviceGroup group(now);
      const BoxSet& boxes = scene_.boxes();
      const std::size_t brought = now[0]->brought();
      if (brought < boxes.size && random_.chance(0.3)) group.bring(boxes, brought, boxes.size);
      group.find(boxes, pairs_);
    } catch (const DeviceFailure&) {
      REQUIRE(failing);
      ++seen_.failures;
      for (const DeviceSweep* member : now) REQUIRE_FALSE(member->context());
      return false;
    }
    failCudaCall(0);
    return true;
  }

  // Boxes from the first on, in pieces; find() brings the others. Sometimes in vain.
  void bringSome(const std::vector<DeviceSweep*>& used) {
    if (random_.chance(0.4)) return;
    DeviceGroup group(used);
    const BoxSet& boxes = scene_.boxes();
    for (std::size_t first = 0, last = 0; first < boxes.size && random_.chance(0.8); first = last) {
      last = first + 1 + random_.below(boxes.size - first);
      group.bring(boxes, first, last);
      REQUIRE(used[0]->brought() == last);
      seen_.pieces += first > 0;
    }
    const bool forgotten = random_.chance(0.2);
    if (forgotten) group.bring(boxes, 1 + random_.below(boxes.size), boxes.size);
    if (forgotten && random_.chance(0.5))
      for (DeviceSweep* member : used) member->wait();
  }

  void check(const std::vector<DeviceSweep*>& used) {
    PairList expected;
    cpu_.find(scene_.boxes(), 1, expected);
    REQUIRE((joined(pairs_) == joined(expected)));
    checkDecidedRuns(pairs_);
    std::size_t bytes = 0;
    for (const auto& member : members_)
      if (member->context()) bytes += member->context()->deviceBytes();
    REQUIRE(bytes == emulation::memoryHeld());
    ++seen_.frames;
    if (used.size() == 1) return;
    ++seen_.shared;
    const auto isBeyond = [](const DeviceSweep* member) { return member->found() > 0; };
    const bool beyond = std::any_of(used.begin(), used.end(), isBeyond);
    ++(beyond ? seen_.beyond_rows : seen_.within_rows);
  }

  Random random_;
  ChangingScene scene_;
  const double failing_;
  Seen& seen_;
  std::vector<std::unique_ptr<DeviceSweep>> members_;
  std::size_t used_ = 0;
  Sweep<float> cpu_;
  PairList pairs_;
};

Seen runAll(int runs, std::uint64_t usual_seed, double failing) {
  DevicePool::get().device(0);  // no other thread makes it ready meanwhile
  Seen seen;
  constexpr int least_runs = 4;
  for (int run = 0; run < std::max(least_runs, sap_test::scaled(runs)); ++run) {
    const std::uint64_t seed = sap_test::seedOr(usual_seed, run);
    INFO("seed " << seed);
    Run frames(seed, run, failing, seen);
    for (int frame = 0; frame < 8; ++frame) frames.frame();
    frames.end();
  }
  return seen;
}

}  // namespace

TEST_CASE("Emulated devices, however many, find the CPU's pairs in its order", "[.][emulation]") {
  const Seen seen = runAll(40, 1, 0);
  CHECK(seen.frames > 0);
  CHECK(seen.shared > 0);
  CHECK(seen.within_rows > 0);
  CHECK(seen.beyond_rows > 0);
  CHECK(seen.pieces > 0);
  CHECK(emulation::device(0).replays > 0);
}

TEST_CASE("A call that fails leaves nothing under way, and the next frame is right",
          "[.][emulation]") {
  const Seen seen = runAll(20, 1000, 0.5);
  CHECK(seen.failures > 0);
  CHECK(seen.frames > 0);
}
