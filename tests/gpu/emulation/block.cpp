// Switching from thread to thread takes no system call, but for AddressSanitizer, which knows of
// swapcontext only: a thread's context is made once, and left and entered again by _longjmp, whose
// checks would take another stack for a mistake.
#undef _FORTIFY_SOURCE

#include "tests/gpu/emulation/block.h"

#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <vector>

#include "tests/gpu/emulation/runtime.h"
#include "tests/support/sanitizers.h"

namespace emulation {

namespace {

constexpr std::size_t stack_bytes = 1 << 18;  // fixed: more than any kernel needs

// What runs on a stack of its own, until it goes on in another one.
class Context {
 public:
  // That of the caller.
  Context() = default;
  explicit Context(void (*run)()) : stack_(new char[stack_bytes]) {
    getcontext(&made_);
    made_.uc_stack.ss_sp = stack_.get();
    made_.uc_stack.ss_size = stack_bytes;
    made_.uc_link = nullptr;
    makecontext(&made_, run, 0);
  }
  // Comes back when another one goes on in this one.
  void goOnIn(Context& other) {
#if ADDRESS_SANITIZER  // which follows swapcontext
    swapcontext(&made_, &other.made_);
#else
    left_ = true;
    if (_setjmp(at_) != 0) return;
    if (other.left_) _longjmp(other.at_, 1);
    setcontext(&other.made_);
#endif
  }

 private:
  std::unique_ptr<char[]> stack_;
  ucontext_t made_;
  jmp_buf at_;
  bool left_ = false;
};

void runThreads();

struct Thread {
  uint3 index = {};
  bool ended = false;
  std::unique_ptr<Context> context = std::make_unique<Context>(&runThreads);
};

struct Warp {
  LaneValues values[2];  // those of the round before stay, for lanes that have not read them yet
  int arrived = 0;
  unsigned round = 0;
};

// The block that runs.
struct Block {
  uint3 index = {};
  dim3 grid;
  const std::function<void()>* body = nullptr;
  std::vector<Thread> threads;
  std::vector<Warp> warps;
  std::vector<std::size_t> order;  // of the threads
  std::size_t turn = 0;            // in it
  int alive = 0, arrived = 0;
  unsigned barriers = 0;
  bool any[2] = {};
  Context caller;
};
Block block;

Thread& current() {
  return block.threads[block.order[block.turn]];
}

void takeTurns() {
  do block.turn = (block.turn + 1) % block.order.size();
  while (current().ended);
}

// On each thread's stack: what the thread does in block after block.
void runThreads() {
  for (;;) {
    (*block.body)();
    Thread& own = current();
    own.ended = true;
    if (--block.alive > 0 && block.arrived == block.alive) {
      block.arrived = 0;
      ++block.barriers;
    }
    if (block.alive > 0) takeTurns();
    own.context->goOnIn(block.alive > 0 ? *current().context : block.caller);
  }
}

// Lets the others run until it is this thread's turn again.
void letOthersRun() {
  Thread& own = current();
  takeTurns();
  if (&current() == &own) {
    std::fprintf(stderr, "a thread of a kernel waits for threads that have ended\n");
    std::abort();
  }
  own.context->goOnIn(*current().context);
}

void arrange(int threads) {
  if (block.threads.size() < static_cast<std::size_t>(threads)) block.threads.resize(threads);
  block.warps.assign((threads + warp_lanes - 1) / warp_lanes, Warp());
  std::vector<int> warps(block.warps.size());
  std::iota(warps.begin(), warps.end(), 0);
  sap_test::shuffle(warps.data(), warps.size(), random());
  block.order.clear();
  for (const int warp : warps)
    for (int i = warp * warp_lanes; i < std::min(threads, (warp + 1) * warp_lanes); ++i) {
      Thread& thread = block.threads[i];
      thread.index = {static_cast<unsigned>(i), 0, 0};
      thread.ended = false;
      block.order.push_back(static_cast<std::size_t>(i));
    }
  block.turn = 0;
  block.alive = threads;
  block.arrived = 0;
  block.any[0] = block.any[1] = false;
}

}  // namespace

void runBlocks(std::size_t blocks, int threads, const std::function<void()>& body) {
  block.grid = dim3(static_cast<unsigned>(blocks));
  block.body = &body;
  for (std::size_t i = 0; i < blocks; ++i) {
    block.index = {static_cast<unsigned>(i), 0, 0};
    arrange(threads);
    block.caller.goOnIn(*current().context);
  }
}

const uint3& threadIndex() {
  return current().index;
}
const uint3& blockIndex() {
  return block.index;
}
const dim3& gridSize() {
  return block.grid;
}
int lane() {
  return static_cast<int>(current().index.x % warp_lanes);
}

void waitForBlock() {
  const unsigned barrier = block.barriers;
  if (++block.arrived == block.alive) {
    block.arrived = 0;
    ++block.barriers;
  }
  while (block.barriers == barrier) letOthersRun();
}

bool anyOfBlock(bool own) {
  bool& any = block.any[block.barriers % 2];
  if (own) any = true;
  waitForBlock();
  const bool result = any;
  waitForBlock();
  any = false;  // each says so before any can come here again
  waitForBlock();
  return result;
}

const LaneValues& exchange(std::uint64_t own) {
  Warp& warp = block.warps[current().index.x / warp_lanes];
  const unsigned round = warp.round;
  LaneValues& values = warp.values[round % 2];
  values[lane()] = own;
  if (++warp.arrived == warp_lanes) {
    warp.arrived = 0;
    ++warp.round;
  }
  while (warp.round == round) letOthersRun();
  return values;
}

}  // namespace emulation
