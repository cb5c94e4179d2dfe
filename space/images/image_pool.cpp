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
#include "space/contacts/collider_threads.h"
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

  // `lent` has room for them.
  void lend(std::size_t wanted, std::size_t pairs, Lent& lent) {
    std::unique_lock<std::mutex> guard(lock_);
    if (closed_) return;
    const std::size_t missing = can_load_ && wanted > free_.size()
                                    ? std::min(wanted - free_.size(), most_images - all_)
                                    : 0;
    if (missing) pairs_ += pairs;
    const char* why = nullptr;
    if (missing && pairs_ >= grained(pairs_worth_an_image) * missing) {
      pairs_ = 0;
      can_load_ = false;  // another thread meanwhile
      guard.unlock();
      why = load(missing);
      guard.lock();
      can_load_ = !why;
    }
    if (std::min(wanted, free_.size()) > 1)
      while (lent.size() < wanted && !free_.empty()) move(free_, lent);
    lent_ += lent.size();
    const std::size_t threads = std::max<std::size_t>(1, all_);
    guard.unlock();
    if (why)
      dMessage(0,
               "parallel SAP space: heightfields, and meshes where ODE has no thread-local "
               "storage, are collided by at most %zu of the threads: %s",
               threads, why);
  }

  void takeBack(Lent& lent) {
    const std::lock_guard<std::mutex> guard(lock_);
    lent_ -= std::min(lent_, lent.size());
    while (!lent.empty()) move(lent, free_);
    returned_.notify_all();
  }

 private:
  Pool() {
    onFork([] { get().lock_.lock(); }, [] { get().lock_.unlock(); }, [] { get().beginChild(); });
  }

  // The last one: a thread mostly gets the image again that is in its cache.
  static void move(Lent& from, Lent& to) {
    to.push_back(from.back());
    from.pop_back();
  }

  // Without the lock: loading takes long.
  const char* load(std::size_t count) try {
    const char* why = nullptr;
    for (; count; --count) {
      auto image = std::make_unique<OdeImage>();
      why = image->load();
      if (why) break;
      const std::lock_guard<std::mutex> guard(lock_);
      free_.reserve(all_ + 1);
      free_.push_back(image.release());
      ++all_;
    }
    // Exit runs it before it destroys what is in the images loaded so far.
    std::atexit([] { get().close(); });
    return why;
  } catch (const std::bad_alloc&) {
    return "there is no memory for it";
  }

  // Images whose threads are not there any more are left as they are.
  void beginChild() {
    lent_ = 0;
    lock_.unlock();
  }

  void close() {
    std::unique_lock<std::mutex> guard(lock_);
    closed_ = true;
    returned_.wait_for(guard, longest_wait, [this] { return lent_ == 0; });
  }

  std::mutex lock_;
  std::condition_variable returned_;
  Lent free_;  // never destroyed, with room for all
  std::size_t all_ = 0, lent_ = 0;
  std::uint64_t pairs_ = 0;
  bool can_load_ = true, closed_ = false;
};

}  // namespace

ThreadColliders::ThreadColliders(int wanted, std::size_t pairs) {
  if (wanted < 2) return;
  lent_.reserve(static_cast<std::size_t>(wanted));
  Pool::get().lend(static_cast<std::size_t>(wanted), pairs, lent_);
}

ThreadColliders::~ThreadColliders() {
  if (!lent_.empty()) Pool::get().takeBack(lent_);
}

}  // namespace ode_parallel_sap
