#include "space/contacts/collider_images.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>

#include "space/contacts/tuning.h"
#include "space/data/platform.h"
#include "space/data/tuning.h"

namespace ode_parallel_sap {

namespace {

// fixed: a bound of the process: each takes some 2 MB, most of it the file in memory.
constexpr std::size_t most_images = 64;

// How long exit() waits for collisions in other threads.
constexpr std::chrono::seconds longest_wait(2);

class Pool {
 public:
  // Never destroyed: threads may be at work when static objects are.
  static Pool& get() {
    static Pool& pool = *new Pool;
    return pool;
  }

  void lend(std::size_t wanted, std::size_t pairs, std::vector<ColliderImage*>& lent) {
    std::unique_lock<std::mutex> guard(lock_);
    if (closed_) return;
    take(wanted, lent);
    const std::size_t missing = missingOf(wanted, lent.size());
    if (missing) pairs_ += pairs;
    if (missing && pairs_ >= grained(pairs_worth_an_image) * missing) {
      pairs_ = 0;
      loading_ += missing;
      guard.unlock();
      const char* const why = load(missing, lent);
      guard.lock();
      loading_ -= missing;
      if (why) complain(guard, why);
    }
    if (lent.size() == 1) giveBack(lent);
  }

  void takeBack(std::vector<ColliderImage*>& lent) {
    const std::lock_guard<std::mutex> guard(lock_);
    giveBack(lent);
  }

 private:
  struct Seat {
    std::unique_ptr<ColliderImage> image;
    enum { Free, Lent, Lost } state;
  };

  Pool() {
    onFork([] { get().lock_.lock(); }, [] { get().lock_.unlock(); }, [] { get().beginChild(); });
  }

  std::size_t missingOf(std::size_t wanted, std::size_t have) const {
    const std::size_t room = most_images - std::min(most_images, seats_.size() + loading_);
    return failed_ ? 0 : std::min(wanted - have, room);
  }

  // Those of lower numbers first: a thread mostly gets the image again that is in its cache.
  void take(std::size_t wanted, std::vector<ColliderImage*>& lent) {
    for (Seat& seat : seats_) {
      if (lent.size() == wanted) return;
      if (seat.state != Seat::Free) continue;
      lent.push_back(seat.image.get());
      seat.state = Seat::Lent;
    }
  }

  void giveBack(std::vector<ColliderImage*>& lent) {
    for (Seat& seat : seats_)
      for (const ColliderImage* image : lent)
        if (seat.image.get() == image) seat.state = Seat::Free;
    lent.clear();
    returned_.notify_all();
  }

  // Without the lock: loading takes long.
  const char* load(std::size_t count, std::vector<ColliderImage*>& lent) try {
    for (; count; --count) {
      auto image = std::make_unique<ColliderImage>();
      if (const char* const why = image->load()) return why;
      const std::lock_guard<std::mutex> guard(lock_);
      lent.reserve(lent.size() + 1);
      seats_.push_back({std::move(image), Seat::Lent});
      lent.push_back(seats_.back().image.get());
    }
    // Exit runs it before it destroys what is in the images loaded so far.
    std::atexit([] { get().close(); });
    return nullptr;
  } catch (const std::bad_alloc&) {
    return "there is no memory for it";
  }

  void complain(std::unique_lock<std::mutex>& guard, const char* why) {
    if (failed_) return;
    failed_ = true;
    const std::size_t images = seats_.size();
    guard.unlock();
    if (images < 2)
      dMessage(
          0,
          "parallel SAP space: heightfields, and meshes where ODE has no thread-local storage, "
          "are collided by the calling thread alone: %s",
          why);
    else
      dMessage(
          0,
          "parallel SAP space: heightfields, and meshes where ODE has no thread-local storage, "
          "are collided by %zu threads at most: %s",
          images, why);
    guard.lock();
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
      for (const Seat& seat : seats_)
        if (seat.state == Seat::Lent) return false;
      return true;
    });
  }

  std::mutex lock_;
  std::condition_variable returned_;
  std::vector<Seat> seats_;
  std::size_t loading_ = 0;
  std::uint64_t pairs_ = 0;
  bool failed_ = false, closed_ = false;
};

}  // namespace

ColliderImages::ColliderImages(int wanted, std::size_t pairs) {
  if (wanted < 2) return;
  try {
    lent_.reserve(static_cast<std::size_t>(wanted));
    Pool::get().lend(static_cast<std::size_t>(wanted), pairs, lent_);
  } catch (...) {
    Pool::get().takeBack(lent_);
    throw;
  }
}

ColliderImages::~ColliderImages() {
  if (!lent_.empty()) Pool::get().takeBack(lent_);
}

}  // namespace ode_parallel_sap
