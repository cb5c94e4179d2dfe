// The stack that a collide takes: programs collide on coroutines and on threads with little of it.
#include <pthread.h>

#include <functional>
#include <memory>

#include "support/calls.h"
#include "support/sanitizers.h"
#include "support/tests.h"

using namespace sap_test;

// Others have larger frames.
#if defined(NDEBUG) && !ADDRESS_SANITIZER && !THREAD_SANITIZER

namespace {

// The bytes of its stack that a thread touches which does this, its own data among them.
std::size_t touchedBy(const std::function<void()>& work) {
  constexpr std::size_t size = 512 << 10;
  constexpr unsigned char paint = 0x5a;
  struct alignas(4096) Stack {
    unsigned char bytes[size];
  };
  const std::unique_ptr<Stack> stack(new Stack);
  std::fill_n(stack->bytes, size, paint);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  REQUIRE(pthread_attr_setstack(&attributes, stack->bytes, size) == 0);
  pthread_t thread;
  const auto run = [](void* data) -> void* {
    dAllocateODEDataForThread(dAllocateMaskAll);
    (*static_cast<const std::function<void()>*>(data))();
    dCleanupODEAllDataForThread();
    return nullptr;
  };
  REQUIRE(pthread_create(&thread, &attributes, run, const_cast<std::function<void()>*>(&work)) ==
          0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  const unsigned char *const begin = stack->bytes, *const end = begin + size;
  return static_cast<std::size_t>(
      end - std::find_if(begin, end, [](unsigned char byte) { return byte != paint; }));
}

// Without what a thread touches in any case: how much its own data take depends on the machine.
std::size_t stackOf(const std::function<void()>& work) {
  const std::size_t idle = touchedBy([] {});
  return touchedBy(work) - idle;
}

// Collides again within the first callback.
struct Nest {
  Call call;
  dSpaceID space;
  int left;

  template <class... Report>
  void operator()(Report...) {
    if (left-- > 0) report(call, space, {}, *this);
  }
};

const struct {
  Call call;
  std::size_t most;  // bytes
} kCallsOfStack[] = {{kNear, 24 << 10}, {kBlocks, 24 << 10}, {kContacts, 32 << 10}};

}  // namespace

TEST_CASE("A collide of up to 120 geoms takes 24 KiB of stack, one within a callback 4 KiB more",
          "[stack]") {
  for (const auto& way : kCallsOfStack)
    for (const std::size_t n : {2, 30, 120})
      for (const bool moving : {false, true}) {
        const Space space;
        World world(space, onePlace(n, 1));
        const auto of = [&](int nested) {
          return stackOf([&, nested] {
            for (int frame = 0; frame < 4; ++frame) {
              Nest nest = {way.call, space, nested};
              if (moving) world.jitter(0.1, 1);
              report(way.call, space, {}, nest);
              CHECK(nest.left < 0);
            }
          });
        };
        const std::size_t alone = of(0), nested = of(10);
        INFO("call " << way.call << ", " << n << " geoms: " << alone << " bytes, ten deep "
                     << nested);
        CHECK(alone <= way.most);
        CHECK(nested <= alone + 10 * (4 << 10));
      }
}

TEST_CASE("A level of dSpaceCollide2 with fewer than 16 geoms takes 0.3 KiB of stack", "[stack]") {
  const auto of = [](int levels) {
    const Space outermost;
    dSpaceID space = outermost;
    for (int i = 0; i < levels; ++i) {
      dCreateSphere(space, 1);
      space = dParallelSAPSpaceCreate(space);
    }
    dCreateSphere(space, 1);
    Pairs pairs;
    const std::size_t bytes = stackOf([&] { dSpaceCollide(outermost, &pairs, recordWithin); });
    REQUIRE(pairs.size() == static_cast<std::size_t>(levels));
    return bytes;
  };
  const std::size_t few = of(20), many = of(120);
  INFO(few << " and " << many << " bytes");
  CHECK(many - few <= 100 * 300);
}

#endif
