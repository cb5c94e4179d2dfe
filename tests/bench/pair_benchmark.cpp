// Who finds the overlapping pairs of moving boxes in what time? One cell is a scene, a number of
// boxes, a peer and a number of threads; those of a scene and size run in turn.
#include <benchmark/benchmark.h>
#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <set>
#include <stdexcept>

#include "bench_scenes.h"
#include "csv.h"
#include "machine.h"
#include "options.h"
#include "pair_check.h"
#include "partly_moving.h"
#include "peer.h"
#include "random.h"
#include "stopwatch.h"
#include "trace_scene.h"

namespace bench {
namespace {

constexpr int frames_before_check = 3;
constexpr int least_samples = 3;  // of a turn, if that takes no more than a second
// Of batches, no two alike: a few that came again and again would teach a processor by heart which
// boxes of a small scene overlap.
constexpr int frames_in_store = 512;

// One scene at one size with one number of threads: what its cells share.
struct Stage {
  const SceneKind& scene;
  std::size_t n;
  int threads;
  bool has_expected = false;
  Overlapping expected{};  // in the frame that is checked
};

// What was measured in a cell, over all its turns.
struct Cell {
  Stage& stage;
  const PeerKind& kind;
  std::vector<double> times{};  // ms
  std::map<std::string, std::vector<double>> stage_times{};
  std::size_t pairs = 0, extra = 0;
  double move_ms = not_known;
  double held_bytes = not_known, peak_bytes = not_known;
  Account account{};
  std::string status = "ok";
  int turns_done = 0;

  const PairSet& expected() const {
    return kind.leaves_out_rest ? stage.expected.of_moved : stage.expected.all;
  }
  std::string name() const {
    return stage.scene.name + "/" + std::to_string(stage.n) + "/" + kind.name +
           "/threads:" + std::to_string(stage.threads);
  }
  bool failed() const { return status != "ok"; }
};

// Times of one find by peer and scene, to precompute that of the next size.
class Forecast {
 public:
  void learn(const Cell& cell) {
    if (cell.times.empty()) return;
    last_[key(cell)] = {cell.stage.n, *std::min_element(cell.times.begin(), cell.times.end())};
  }

  // Seconds, if time grows with the square of the size at worst; 0 if nothing is known.
  double seconds(const Cell& cell) const {
    const auto known = last_.find(key(cell));
    if (known == last_.end()) return 0;
    const double growth =
        static_cast<double>(cell.stage.n) / static_cast<double>(known->second.first);
    return known->second.second / 1000 * std::max(1.0, growth * growth);
  }

 private:
  static std::string key(const Cell& cell) {
    return cell.stage.scene.name + "/" + cell.kind.name + "/" + std::to_string(cell.stage.threads);
  }
  std::map<std::string, std::pair<std::size_t, double>> last_;
};

// A peer in action: it exists from the first call of Google Benchmark for a turn until the last.
class Turn {
 public:
  explicit Turn(Cell& cell) : cell_(cell), scene_(makeScene(cell)) {
    const std::string refusal = cell.kind.refuses(scene_->boxes());
    if (!refusal.empty()) throw std::runtime_error(refusal);
    peer_ = cell.kind.create(cell.stage.threads);
    peer_->create(scene_->boxes());
    if (options().batch > 0) {
      storeFrames();
      measureMoving();
    }
    trimHeap();
    resetPeak();
    resident_before_ = residentBytes();
    peer_->enter();
    for (int i = 0; i < frames_before_check; ++i) findNext();
    rememberMemory();
    if (cell.turns_done == 0) check();
  }

  // Milliseconds of one find.
  double findNext() {
    advance();
    const Stopwatch clock;
    pairs_ = peer_->find();
    return clock.milliseconds();
  }

  // Milliseconds of a frame, moving included, as the mean of a batch.
  double findBatch() {
    const int count = options().batch;
    const Stopwatch clock;
    for (int i = 0; i < count; ++i) {
      moveToStored();
      benchmark::DoNotOptimize(pairs_ = peer_->find());
    }
    return clock.milliseconds() / count;
  }

  // One more measurement, moving taken off; returns the milliseconds.
  double measure() {
    const double milliseconds = options().batch > 0 ? findBatch() - cell_.move_ms : findNext();
    sample(milliseconds);
    return milliseconds;
  }

  // What Google Benchmark was content with may be a single frame.
  void complete() {
    double seconds = 0;
    while (samples_ < least_samples && seconds < 1) seconds += measure() / 1000;
    if (options().batch > 0) ask();
  }

 private:
  void sample(double milliseconds) {
    ++samples_;
    cell_.times.push_back(milliseconds);
    cell_.pairs = pairs_;
    if (options().batch == 0) ask();
  }

  // What the last frame was. Where frames are small, once they have been timed: a space that was
  // asked times its stages from then on, which takes as long as a few geoms do.
  void ask() {
    cell_.account = peer_->account();
    const Stages& stages = cell_.account.stages;
    cell_.stage_times["update"].push_back(stages.update);
    cell_.stage_times["synchronise"].push_back(stages.synchronise);
    cell_.stage_times["extract"].push_back(stages.extract);
    cell_.stage_times["filter"].push_back(stages.filter);
    cell_.stage_times["report"].push_back(stages.report);
  }

  static std::unique_ptr<MovingScene> makeScene(const Cell& cell) {
    auto scene = cell.stage.scene.make(cell.stage.n, options().seed);
    if (options().moving >= 1) return scene;
    return std::make_unique<PartlyMoving>(std::move(scene), options().moving);
  }

  // Where nothing moves the first frames tell so, and the timed ones tell nothing.
  void advance() {
    if (options().still && samples_ > 0) return;
    if (!options().still) scene_->advance();
    peer_->move(scene_->boxes());
  }

  // Boxes tremble as well, by up to a twentieth of their width.
  void storeFrames() {
    if (options().still) return;
    sap_test::Random random(options().seed);
    for (int i = 0; i < frames_in_store; ++i) {
      scene_->advance();
      frames_.push_back(scene_->boxes());
      for (CentredBox& box : frames_.back())
        for (int axis = 0; axis < 3; ++axis)
          box.centre[axis] += box.half[axis] * static_cast<dReal>(random.between(-0.1, 0.1));
    }
  }

  void moveToStored() {
    if (options().still) return;
    peer_->move(frames_[next_frame_]);
    next_frame_ = (next_frame_ + 1) % frames_.size();
  }

  // The same calls while the user's objects are in no structure yet.
  void measureMoving() {
    if (options().still) {
      cell_.move_ms = 0;
      return;
    }
    std::vector<double> times;
    for (int round = 0; round < 20; ++round) {
      const Stopwatch clock;
      for (int i = 0; i < options().batch; ++i) moveToStored();
      times.push_back(clock.milliseconds() / options().batch);
    }
    cell_.move_ms = median(times);
  }

  void rememberMemory() {
    const auto above = [&](std::size_t bytes) {
      return bytes > resident_before_ ? static_cast<double>(bytes - resident_before_) : 0.0;
    };
    cell_.held_bytes = above(residentBytes());
    cell_.peak_bytes = above(peakResidentBytes());
  }

  void check() {
    const Boxes before = scene_->boxes();
    advance();
    Stage& stage = cell_.stage;
    if (!stage.has_expected)
      stage.expected = overlapping(scene_->boxes(), differing(before, scene_->boxes()));
    stage.has_expected = true;
    const Reported reported = reportedBy(*peer_, scene_->boxes());
    cell_.extra = reported.extra;
    const std::string fault = faultOf(reported, cell_.expected(), !cell_.kind.superset.empty());
    if (!fault.empty()) cell_.status = fault;
  }

  Cell& cell_;
  std::unique_ptr<MovingScene> scene_;
  std::unique_ptr<Peer> peer_;
  std::vector<Boxes> frames_;
  std::size_t next_frame_ = 0;
  std::size_t resident_before_ = 0;
  std::size_t pairs_ = 0;
  int samples_ = 0;
};

Row rowOf(const Cell& cell) {
  const auto stage = [&](const char* name) {
    const auto found = cell.stage_times.find(name);
    return found == cell.stage_times.end() ? not_known : median(found->second);
  };
  const double total = median(cell.times);
  const double least =
      cell.times.empty() ? not_known : *std::min_element(cell.times.begin(), cell.times.end());
  const Account& account = cell.account;
  const bool ran = !cell.times.empty();
  Row row;
  row.add("scene", cell.stage.scene.name)
      .add("n", cell.stage.n)
      .add("peer", cell.kind.name)
      .add("library", cell.kind.library)
      .add("threads", cell.stage.threads)
      .add("moving", options().still ? 0.0 : options().moving)
      .add("status", cell.status)
      .add("samples", cell.times.size())
      .add("median_ms", total)
      .add("min_ms", least)
      .add("mean_ms", mean(cell.times))
      .add("move_ms", cell.move_ms)
      .add("pairs", cell.expected().count)
      .add("extra_pairs", cell.extra)
      .add("ns_per_pair", ran && cell.expected().count > 0
                              ? 1e6 * total / static_cast<double>(cell.expected().count)
                              : not_known)
      .add("update_ms", stage("update"))
      .add("synchronise_ms", stage("synchronise"))
      .add("extract_ms", stage("extract"))
      .add("filter_ms", stage("filter"))
      .add("report_ms", stage("report"))
      .add("held_bytes", cell.held_bytes)
      .add("peak_bytes", cell.peak_bytes)
      .add("own_bytes", account.own_bytes)
      .add("method", account.method)
      .add("backend", account.backend)
      .add("threads_used", ran ? std::to_string(account.threads) : std::string())
      .add("devices_used", ran ? std::to_string(account.devices) : std::string())
      .addMachine();
  return row;
}

// Runs cells through Google Benchmark and writes their rows.
class Runner {
 public:
  explicit Runner(Csv& csv) : csv_(csv) {}

  void registerTurn(Cell& cell) {
    benchmark::RegisterBenchmark(cell.name().c_str(),
                                 [this, &cell](benchmark::State& state) { run(cell, state); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->MinTime(options().budget / options().rounds);
  }

  // Called when Google Benchmark is through with a turn of a cell.
  void finishTurn() {
    if (!cell_) return;
    if (turn_) turn_->complete();
    turn_.reset();
    trimHeap();
    ++cell_->turns_done;
    if (cell_->turns_done == options().rounds) {
      forecast_.learn(*cell_);
      csv_.write(rowOf(*cell_));
      if (cell_->status.rfind("wrong", 0) == 0) wrong_.push_back(*cell_);
    }
    cell_ = nullptr;
  }

  // Those that found other pairs than they should have.
  const std::vector<Cell>& wrong() const { return wrong_; }

 private:
  void run(Cell& cell, benchmark::State& state) {
    cell_ = &cell;
    if (!turn_ && !cell.failed()) begin(cell);
    if (cell.failed()) {
      state.SkipWithError(cell.status.c_str());
      return;
    }
    for (auto _ : state) {
      const double milliseconds = turn_->measure();
      state.SetIterationTime(std::max(milliseconds, 0.0) / 1000 * std::max(options().batch, 1));
    }
    report(cell, state);
  }

  void begin(Cell& cell) {
    const double seconds = forecast_.seconds(cell);
    if (seconds > options().limit) {
      cell.status = "left out: might take " + std::to_string(std::lround(seconds)) + " s";
      return;
    }
    try {
      turn_ = std::make_unique<Turn>(cell);
    } catch (const std::exception& error) {
      cell.status = std::string("left out: ") + error.what();
    }
  }

  static void report(const Cell& cell, benchmark::State& state) {
    state.counters["median_ms"] = median(cell.times);
    state.counters["pairs"] = static_cast<double>(cell.expected().count);
    state.counters["extra"] = static_cast<double>(cell.extra);
    for (const auto& [name, times] : cell.stage_times) {
      const double value = median(times);
      if (!std::isnan(value)) state.counters[name] = value;
    }
  }

  Csv& csv_;
  Forecast forecast_;
  Cell* cell_ = nullptr;
  std::unique_ptr<Turn> turn_;
  std::vector<Cell> wrong_;
};

// Prints as Google Benchmark does, and tells the runner when a turn is over.
class Reporter : public benchmark::ConsoleReporter {
 public:
  explicit Reporter(Runner& runner) : ConsoleReporter(OO_None), runner_(runner) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    GetOutputStream().flush();
    runner_.finishTurn();
  }

 private:
  Runner& runner_;
};

std::vector<SceneKind> allScenes() {
  std::vector<SceneKind> all = sceneKinds(options().piles);
  if (!options().trace.empty()) all.push_back(traceScene(options().trace));
  return all;
}

std::vector<SceneKind> chosenScenes() {
  std::vector<SceneKind> all = allScenes(), chosen;
  for (const std::string& name : options().scenes) {
    if (name == "all") return all;
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const SceneKind& s) { return s.name == name; });
    if (found == all.end()) throw std::invalid_argument("no scene " + name + "; see --list");
    chosen.push_back(*found);
  }
  return chosen;
}

// Those asked for, which must exist; without a wish those that are to be had, ours with its own
// choice of method only.
std::vector<PeerKind> chosenPeers() {
  std::vector<PeerKind> chosen;
  const std::set<std::string> wished(options().peers.begin(), options().peers.end());
  std::set<std::string> known;
  for (const PeerKind& kind : peerKinds()) {
    known.insert(kind.name);
    const bool variant = kind.name.find(':') != std::string::npos;
    if (wished.empty() ? variant : !wished.count(kind.name)) continue;
    if (kind.create(1))
      chosen.push_back(kind);
    else if (wished.count(kind.name))
      std::fprintf(stderr, "pair-benchmark: %s is not to be had here\n", kind.name.c_str());
  }
  for (const std::string& name : wished)
    if (!known.count(name)) throw std::invalid_argument("no peer " + name + "; see --list");
  return chosen;
}

void printList() {
  std::printf("Scenes\n");
  for (const SceneKind& scene : allScenes())
    std::printf("  %-22s %s\n", scene.name.c_str(), scene.about.c_str());
  std::printf("Peers\n");
  for (const PeerKind& kind : peerKinds())
    std::printf("  %-30s %s%s%s%s\n", kind.name.c_str(), kind.library.c_str(),
                kind.create(1) ? "" : " (not to be had here)", kind.superset.empty() ? "" : "; ",
                kind.superset.c_str());
}

// Peers that take no number of threads run once, on the first of all numbers that is one.
bool runsOn(const PeerKind& kind, int threads) {
  if (threads == 0) return kind.chooses_threads;
  const std::vector<int>& all = options().threads;
  const auto first = std::find_if(all.begin(), all.end(), [](int number) { return number > 0; });
  return kind.takes_threads || threads == *first;
}

int run(int argc, char** argv) {
  const std::vector<SceneKind> scenes = chosenScenes();
  const std::vector<PeerKind> peers = chosenPeers();
  Csv csv(options().csv, options().append);
  Runner runner(csv);
  std::vector<std::unique_ptr<Stage>> stages;
  std::vector<std::unique_ptr<Cell>> cells;
  std::sort(options().sizes.begin(), options().sizes.end());
  for (const SceneKind& scene : scenes) {
    for (std::size_t n : scene.always ? std::vector<std::size_t>{scene.always} : options().sizes) {
      if (n > scene.most) continue;
      const std::size_t first = cells.size();
      for (int threads : options().threads) {
        stages.push_back(std::make_unique<Stage>(Stage{scene, n, threads}));
        for (const PeerKind& kind : peers)
          if (n <= kind.most && runsOn(kind, threads))
            cells.push_back(std::make_unique<Cell>(Cell{*stages.back(), kind}));
      }
      for (int round = 0; round < options().rounds; ++round)
        for (std::size_t i = first; i < cells.size(); ++i) runner.registerTurn(*cells[i]);
    }
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  Reporter reporter(runner);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  // What another library finds or misses is its own affair, and a finding; it was not timed.
  bool ours = false;
  for (const Cell& cell : runner.wrong()) {
    std::fprintf(stderr, "pair-benchmark: %s: %s\n", cell.name().c_str(), cell.status.c_str());
    ours = ours || cell.kind.name.rfind("parallel-sap", 0) == 0;
  }
  return ours ? 1 : 0;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::parseOptions(argc, argv);
  dInitODE2(0);
  int result = 0;
  try {
    if (bench::options().list)
      bench::printList();
    else
      result = bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pair-benchmark: %s\n", error.what());
    result = 2;
  }
  dCloseODE();
  return result;
}
