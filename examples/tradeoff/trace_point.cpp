#include "trace_point.h"

#include <stdexcept>

#include "replay_timing.h"

namespace tradeoff {

namespace {

trace::Setting settingOf(const TraceSettings& settings, double usual_size) {
  trace::Setting setting;
  const bool all = settings.skip == "all";
  setting.space = settings.space;
  setting.threads = settings.threads;
  setting.devices = settings.devices;
  setting.skip_static = all || settings.skip == "static";
  setting.skip_asleep = all || settings.skip == "asleep";
  setting.cull_planes = all || settings.skip == "planes";
  setting.tolerance = settings.tolerance * usual_size;
  setting.work = settings.work == "loop"       ? trace::Work::loop
                 : settings.work == "contacts" ? trace::Work::contacts
                                               : trace::Work::pairs;
  setting.contacts = settings.contacts;
  setting.turns = settings.turns;
  return setting;
}

}  // namespace

Row measureTrace(const TraceSettings& settings) {
  const trace::Recording recording = trace::readRecording(settings.file);
  const trace::Setting setting = settingOf(settings, trace::usualSize(recording));
  if (!trace::isToBeHad(setting)) throw std::runtime_error("GPUs are not to be had here");
  const trace::Timing timing = trace::measure(recording, setting);
  Row row;
  row.add("ms", timing.median_ms);
  row.add("least_ms", timing.least_ms);
  row.add("pairs", timing.pairs);
  row.add("contacts", timing.contacts);
  row.add("tolerance_length", setting.tolerance);
  row.add("frames", recording.frames.size());
  return row;
}

}  // namespace tradeoff
