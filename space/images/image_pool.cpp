// The process's images of ODE, and who has them. No two lenders have one at a time. They are loaded
// when there have been pairs enough to pay for it, and kept for the life of the process, through
// fork and exit. The first that cannot be loaded ends that; dMessage tells why, once.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>

#include "space/base/platform.h"
#include "space/base/tuning.h"
#include "space/contacts/thread_colliders.h"
#include "space/images/ode_image.h"

namespace ode_parallel_sap {

namespace {

// Pairs that take as long as loading an image does, 1.5 ms, at 1.5 us a pair of a box and a mesh:
// whatever comes, it has cost no more than twice what would have been best.
constexpr std::uint64_t pairs_worth_an_image = 1000;

// fixed: a bound of the process: each takes some 2 MB, most of it the file in memory.
constexpr std::size_t most_images = 64;

// How long exit() waits for collisions in other threads.
constexpr std::chrono::seconds longest_wait(2);

using Lent = std::vector<ThreadCollider*>;

class Pool {
 public:
  // Never destroyed: threads may be at work when static objects are.
  static Pool& get() {
    static Pool& pool = *new Pool;
    return pool;
  }

  void lend(std::size_t wanted, std::size_t pairs, Lent& lent) {
    std::unique_lock<std::mutex> guard(lock_);
    if (closed_) return;
    take(wanted, lent);
    const std::size_t missing =
        can_load_ ? std::min(wanted - lent.size(), most_images - seats_.size()) : 0;
    if (missing) pairs_ += pairs;
    const char* why = nullptr;
    if (missing && pairs_ >= grained(pairs_worth_an_image) * missing) {
      pairs_ = 0;
      can_load_ = false;  // another thread meanwhile
      guard.unlock();
      why = load(missing, lent);
      guard.lock();
      can_load_ = !why;
    }
    if (lent.size() == 1) giveBack(lent);
    const std::size_t threads = std::max<std::size_t>(1, seats_.size());
    guard.unlock();
    if (why)
      dMessage(0,
               "parallel SAP space: heightfields, and meshes where ODE has no thread-local "
               "storage, are collided by at most %zu of the threads: %s",
               threads, why);
  }

  void takeBack(Lent& lent) {
    const std::lock_guard<std::mutex> guard(lock_);
    giveBack(lent);
  }

 private:
  struct Seat {
    std::unique_ptr<OdeImage> image;
    enum { Free, Lent, Lost } state;
  };

  Pool() {
    onFork([] { get().lock_.lock(); }, [] { get().lock_.unlock(); }, [] { get().beginChild(); });
  }

  // Those of lower numbers first: a thread mostly gets the image again that is in its cache.
  void take(std::size_t wanted, Lent& lent) {
    for (Seat& seat : seats_) {
      if (lent.size() == wanted) return;
      if (seat.state != Seat::Free) continue;
      lent.push_back(seat.image.get());
      seat.state = Seat::Lent;
    }
  }

  void giveBack(Lent& lent) {
    for (Seat& seat : seats_)
      if (std::count(lent.begin(), lent.end(), seat.image.get())) seat.state = Seat::Free;
    lent.clear();
    returned_.notify_all();
  }

  // Without the lock: loading takes long.
  const char* load(std::size_t count, Lent& lent) try {
    const char* why = nullptr;
    for (; count; --count) {
      auto image = std::make_unique<OdeImage>();
      why = image->load();
      if (why) break;
      const std::lock_guard<std::mutex> guard(lock_);
      lent.reserve(lent.size() + 1);
      seats_.push_back({std::move(image), Seat::Lent});
      lent.push_back(seats_.back().image.get());
    }
    // Exit runs it before it destroys what is in the images loaded so far.
    std::atexit([] { get().close(); });
    return why;
  } catch (const std::bad_alloc&) {
    return "there is no memory for it";
  }

  // Images whose threads are not there any more are left as they are.
  void beginChild() {
    for (Seat& seat : seats_)
      if (seat.state == Seat::Lent) seat.state = Seat::Lost;
    lock_.unlock();
  }

  void close() {
    std::unique_lock<std::mutex> guard(lock_);
    closed_ = true;
    returned_.wait_for(guard, longest_wait, [this] {
      return std::none_of(seats_.begin(), seats_.end(),
                          [](const Seat& seat) { return seat.state == Seat::Lent; });
    });
  }

  std::mutex lock_;
  std::condition_variable returned_;
  std::vector<Seat> seats_;
  std::uint64_t pairs_ = 0;
  bool can_load_ = true, closed_ = false;
};

}  // namespace

ThreadColliders::ThreadColliders(int wanted, std::size_t pairs) {
  if (wanted < 2) return;
  lent_.reserve(static_cast<std::size_t>(wanted));
  try {
    Pool::get().lend(static_cast<std::size_t>(wanted), pairs, lent_);
  } catch (...) {
    Pool::get().takeBack(lent_);
    throw;
  }
}

ThreadColliders::~ThreadColliders() {
  if (!lent_.empty()) Pool::get().takeBack(lent_);
}

}  // namespace ode_parallel_sap
