#include "interrupt.h"

#include <array>
#include <atomic>
#include <csignal>

namespace pile {
namespace {

constexpr std::array<int, 2> signals = {SIGINT, SIGTERM};
std::atomic<int> received = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a handler must not wait");

void receive(int number) {
  std::signal(number, SIG_DFL);
  received = number;
}

void handle(int number, void (*handler)(int)) {
  if (std::signal(number, handler) == SIG_IGN) std::signal(number, SIG_IGN);
}

}  // namespace

Interrupt::Interrupt() {
  received = 0;
  for (const int number : signals) handle(number, receive);
}

Interrupt::~Interrupt() {
  for (const int number : signals) handle(number, SIG_DFL);
}

int Interrupt::signal() {
  return received;
}

}  // namespace pile
