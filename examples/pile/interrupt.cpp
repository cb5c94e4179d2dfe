#include "interrupt.h"

#include <signal.h>

#include <array>
#include <atomic>

namespace pile {
namespace {

constexpr std::array<int, 2> signals = {SIGINT, SIGTERM};
std::atomic<int> received = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a handler must not wait");

void receive(int number) {
  received = number;
}

bool isIgnored(int number) {
  struct sigaction now = {};
  return sigaction(number, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

}  // namespace

Interrupt::Interrupt() {
  received = 0;
  struct sigaction once = {};
  once.sa_handler = receive;
  once.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  for (const int number : signals)
    if (!isIgnored(number)) sigaction(number, &once, nullptr);
}

Interrupt::~Interrupt() {
  for (const int number : signals)
    if (!isIgnored(number)) ::signal(number, SIG_DFL);
}

int Interrupt::signal() {
  return received;
}

}  // namespace pile
