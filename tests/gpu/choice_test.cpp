// Where a scene is sent, with made-up machines whose times are known.
#include <algorithm>
#include <functional>
#include <vector>

#include "space/frame/device_choice.h"
#include "support/catch.hpp"

using ode_parallel_sap::DeviceChoice;

namespace {

using Candidates = DeviceChoice::Candidates;

// Milliseconds of a frame of so many boxes on so many devices, 0: the processor.
using Machine = std::function<double(int devices, double boxes)>;

struct Run {
  double ms = 0;    // of the frames that count
  int wanted = 0;   // devices, at most
  int changes = 0;  // of the choice, in frames that count
  int last = 0;     // choice
};

// Frames of one size. Devices that are wanted are ready some frames later; the first frames on a
// number of devices take ten times as long.
Run run(DeviceChoice& choice, const Machine& machine, double boxes, int available, int frames,
        int counted) {
  Run made;
  int ready = 0, ready_at = -1;
  std::vector<int> used(DeviceChoice::most_devices + 1);
  for (int frame = 0; frame < frames; ++frame) {
    if (frame == ready_at) ready = made.wanted;
    const auto n = static_cast<std::size_t>(boxes);
    const DeviceChoice::Decision decision = choice.decide(n, Candidates(true, ready));
    const int devices = decision.devices;
    if (devices > ready) FAIL(devices << " devices chosen, " << ready << " are ready");
    const double ms = machine(devices, boxes) * (used[devices]++ < 2 ? 10 : 1);
    choice.learn(decision, devices, n, static_cast<std::size_t>(4.6 * boxes), ms);
    const int wanted = choice.learnMissed(n, Candidates(true, available), ready);
    if (wanted > made.wanted) ready_at = frame + 5;
    made.wanted = std::max(made.wanted, wanted);
    if (frame >= frames - counted) {
      made.ms += ms;
      made.changes += devices != made.last;
    }
    made.last = devices;
  }
  return made;
}

double bestOf(const Machine& machine, double boxes, int available) {
  double best = machine(0, boxes);
  for (int devices = 1; devices <= available; devices *= 2)
    best = std::min(best, machine(devices, boxes));
  return best;
}

double cores16(double n) {
  return n < 4096 ? 1e-4 * n + 1e-7 * n * std::min(n, 700.0) : 0.2 + 1.25e-5 * n;
}
double h200(int devices, double n) {
  return devices == 1 ? 0.1 + 1.45e-6 * n : 0.6 + 1.55e-6 * n / devices;
}

const struct {
  const char* name;
  Machine time;
} machines[] = {
    {"sixteen cores, fast devices", [](int d, double n) { return d ? h200(d, n) : cores16(n); }},
    {"devices as slow as ten times less",
     [](int d, double n) { return d ? 10 * h200(d, n) : cores16(n); }},
    {"devices slower than the processor at any size",
     [](int d, double n) { return d ? 0.2 + 2e-5 * n : cores16(n); }},
    {"two slow cores", [](int d, double n) { return d ? h200(d, n) : 0.01 + 2e-4 * n; }},
    {"more devices never pay",
     [](int d, double n) { return d ? h200(1, n) * (1 + 0.3 * (d - 1)) : cores16(n); }},
    {"two devices that pay a little sooner than precomputed",
     [](int d, double n) {
       return d ? (d == 1 ? 0.1 + 1.7e-6 * n : 0.4 + 1.84e-6 * n / d) : cores16(n);
     }},
    {"devices with a long way to them",
     [](int d, double n) { return d ? 3 + h200(d, n) : cores16(n); }},
};

}  // namespace

TEST_CASE("A choice is never a tenth slower than the best fixed one", "[choice]") {
  for (const auto& machine : machines)
    for (double boxes = 2; boxes < 2e7; boxes *= 1.2) {
      DeviceChoice choice;
      const int counted = 2000;
      // Long enough that all are ready and known which save next to nothing.
      const Run made = run(choice, machine.time, boxes, 4, 20000, counted);
      INFO(machine.name << ", " << boxes << " boxes, at last " << made.last << " devices");
      // No device is asked for while it could save next to nothing.
      const double ms = made.ms / counted, best = bestOf(machine.time, boxes, 4);
      CHECK(ms <= 1.1 * best + 0.01);
      CHECK(made.changes <= 12);  // each of the others is tried twice at most
    }
}

TEST_CASE("A device is wanted only after time was missed", "[choice]") {
  DeviceChoice choice;
  // 100,000 boxes: some 1.2 ms a frame to be saved.
  CHECK(run(choice, machines[0].time, 1e5, 1, 30, 1).wanted == 0);
  CHECK(run(choice, machines[0].time, 1e5, 1, 100, 1).wanted == 1);
}

TEST_CASE("A device whose first frames were slow is soon known as fast", "[choice]") {
  // Two devices are slower than one, but faster than what one seemed to be.
  for (const int slow : {4, 6, 8})
    for (const double by : {1.3, 1.6, 2.0}) {
      int frames_on_one = 0;
      const Machine time = [&](int d, double) {
        if (d == 1) return 1.2 * (++frames_on_one <= slow ? by : 1);
        return d == 0 ? 4.2 : 1.5;
      };
      DeviceChoice choice;
      constexpr std::size_t boxes = 500000;
      double ms = 0;
      for (int frame = 0; frame < 200; ++frame) {
        const DeviceChoice::Decision decision = choice.decide(boxes, Candidates(true, 2));
        const double taken = time(decision.devices, boxes);
        choice.learn(decision, decision.devices, boxes, 46 * boxes / 10, taken);
        if (frame >= 100) ms += taken / 100;
      }
      INFO(slow << " frames slow by " << by);
      CHECK(ms <= 1.05 * 1.2);
    }
}

TEST_CASE("Devices that were lost are tried anew once they are back", "[choice]") {
  DeviceChoice choice;
  const Run made = run(choice, machines[0].time, 16e6, 4, 300, 10);
  REQUIRE(made.last == 4);
  choice.lost(1);
  CHECK(choice.learnMissed(16000000, Candidates(true, 1), 1) == 1);
  CHECK(choice.decide(16000000, Candidates(true, 1)).devices == 1);
  CHECK(choice.decide(16000000, Candidates(true, 4)).begins_trial);
}

TEST_CASE("A number of devices that is set is the only one but the processor", "[choice]") {
  const auto three = Candidates(true, 3, 3);
  CHECK(std::vector<int>(three.begin(), three.end()) == std::vector<int>{0, 3});
  const auto forced = Candidates(false, 100, 100);
  CHECK(std::vector<int>(forced.begin(), forced.end()) ==
        std::vector<int>{DeviceChoice::most_devices});
  DeviceChoice choice;
  CHECK(choice.decide(1000, Candidates(false, 3, 3)).devices == 3);
}
