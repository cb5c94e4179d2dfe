// Where the pairs of a scene are found soonest: on the processor, or on how many devices.
#pragma once

#include <algorithm>
#include <cstddef>

#include "space/base/tuning.h"

namespace ode_parallel_sap {

// A choice is a number of devices; 0 is the processor. A model predicts its time from boxes and
// pairs, and frames that ran on it correct the model. Each frame goes to the choice that promises
// the least. One that was never tried, or lost, gets a trial of a few frames if it promises to be
// better, at growing intervals. Devices are made ready once they would have saved enough time.
class DeviceChoice {
 public:
  static constexpr int most_devices = 16;  // fixed: as many as a machine has; a limit of arrays

  // What may be chosen: the processor, and 1, 2, 4 ... up to all devices, or `only` so many.
  class Candidates {
   public:
    Candidates(bool processor, int devices, int only = 0) {
      if (processor) devices_[count_++] = 0;
      const int most = std::min(only ? std::min(only, devices) : devices, most_devices);
      for (int d = only ? std::max(most, 1) : 1; d <= most; d *= 2) devices_[count_++] = d;
    }
    const int* begin() const { return devices_; }
    const int* end() const { return devices_ + count_; }
    bool has(int devices) const { return std::find(begin(), end(), devices) != end(); }

   private:
    int devices_[8] = {};
    int count_ = 0;
  };

  // What one frame is to run on.
  struct Decision {
    int devices = 0;            // 0: the processor
    bool begins_trial = false;  // of an option that was never tried, or lost some time ago
  };

  // For the next frame, of so many boxes. There is a candidate.
  Decision decide(std::size_t boxes, const Candidates& candidates) const {
    if (trial_ > 0 && candidates.has(choice_)) return {choice_, false};
    const double pairs = pairs_a_box_ * static_cast<double>(boxes);
    int best = *candidates.begin();
    for (const int devices : candidates)
      if (isKnown(devices) &&
          (!isKnown(best) || predict(devices, boxes, pairs) < predict(best, boxes, pairs)))
        best = devices;
    // Stays where it is unless it clearly pays.
    if (isKnown(choice_) && candidates.has(choice_) &&
        predict(best, boxes, pairs) > hysteresis * predict(choice_, boxes, pairs))
      best = choice_;
    if (!isKnown(best)) return {best, false};
    for (const int devices : candidates)
      if (devices != best && deservesTrial(devices, best, boxes, pairs)) return {devices, true};
    return {best, false};
  }

  // What a frame took to find its pairs on `devices`, fewer than decided if some failed.
  void learn(const Decision& decision, int devices, std::size_t boxes, std::size_t pairs,
             double ms) {
    if (boxes == 0) return;
    if (choice_ != decision.devices) trial_ = 0;
    choice_ = decision.devices;
    if (decision.begins_trial) {
      Option& tried = options_[choice_];
      trial_ = tried.settling + trial_frames;
      if (tried.off > 0)
        tried.interval = std::min<long>(2 * tried.interval, back_off_range * retry_frames);
    }
    ++frame_;
    pairs_a_box_ = static_cast<double>(pairs) / static_cast<double>(boxes);
    const bool on_trial = devices == choice_ && trial_ > 0;
    trial_ -= on_trial;
    Option& option = options_[devices];
    // Its storage and its threads come into being.
    if (option.settling > 0) {
      --option.settling;
      return;
    }
    const double off = ms / model(devices, boxes, static_cast<double>(pairs));
    const double weight = on_trial ? trial_weight : newest_weight;
    option.off = isKnown(devices) ? option.off + weight * (off - option.off) : off;
    option.last_frame = frame_;
  }

  // Adds what the frame just learnt, of so many boxes, would have saved on more devices than are
  // `ready`. Returns how many of the `candidates` are worth making ready by now.
  int learnMissed(std::size_t boxes, const Candidates& candidates, int ready) {
    if (!isKnown(choice_) || trial_ > 0) return wanted_;
    const double pairs = pairs_a_box_ * static_cast<double>(boxes);
    const double now = predict(choice_, boxes, pairs);
    for (const int devices : candidates) {
      if (devices <= ready) continue;
      const double then = predict(devices, boxes, pairs);
      if (then > now) continue;
      missed_ms_ += now - then;
      if (missed_ms_ > least_missed_ms) {
        missed_ms_ = 0;
        wanted_ = devices;
      }
      break;
    }
    return wanted_;
  }

  // So many devices are usable: what is known of more is void.
  void lost(int devices_left) {
    for (int devices = devices_left + 1; devices <= most_devices; ++devices)
      options_[devices] = Option();
    wanted_ = wanted_ < devices_left ? wanted_ : devices_left;
  }

 private:
  struct Option {
    double off = 0;    // time taken by time predicted; 0: not known
    int settling = 3;  // frames until its times mean something
    long last_frame = 0;
    long interval = retry_frames;  // until it is tried again
  };

  // fixed: the frames after the first ones that a trial compares; one alone may be disturbed.
  static constexpr int trial_frames = 2;

  bool isKnown(int devices) const { return options_[devices].off > 0; }

  // Milliseconds, by the shape of the curves on one and two H200 (cuda/README.md).
  static double model(int devices, std::size_t boxes, double pairs) {
    const double n = static_cast<double>(boxes);
    if (devices == 0) return 0.002 + 0.9e-5 * n + 2e-6 * pairs;
    const double shared = 0.75e-6 * n + 0.155e-6 * pairs;
    return devices == 1 ? 0.09 + shared : 0.16 + (0.2 + 0.84 / devices) * shared;
  }
  // An option that was never tried is taken to be as far off as the nearest one with fewer devices.
  double predict(int devices, std::size_t boxes, double pairs) const {
    int known = devices;
    while (known > 0 && !isKnown(known)) --known;
    const double off = known > 0 || devices == 0 ? options_[known].off : 1;
    return off * model(devices, boxes, pairs);
  }
  bool deservesTrial(int devices, int best, std::size_t boxes, double pairs) const {
    const Option& option = options_[devices];
    const double promised = predict(devices, boxes, pairs), now = predict(best, boxes, pairs);
    if (!isKnown(devices)) return promised < now;
    return frame_ - option.last_frame >= option.interval && promised <= worth_another_try * now;
  }

  Option options_[most_devices + 1];
  int choice_ = 0, trial_ = 0, wanted_ = 0;
  long frame_ = 0;
  double pairs_a_box_ = 0;
  double missed_ms_ = 0;
};

}  // namespace ode_parallel_sap
