// The sweep on one device beside cuBQL's trees there, from boxes in host memory to pairs in host
// memory, in the scenes of cuda/check.
#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <parallel/algorithm>
#include <string>
#include <vector>

#include "cuda/check/scenes.h"
#include "cuda/finder/cuda_sweep.h"
#include "space/pairs/sweep.h"
#include "tests/bench/csv.h"
#include "tests/bench/devices/cubql_pairs.h"
#include "tests/bench/stopwatch.h"

namespace bench {
namespace {

using namespace ode_parallel_sap;
using cuda_check::Scene;

constexpr char wrong[] = "wrong: pairs";
constexpr double slow_ms = 200;
constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

struct Options {
  std::string csv;
  int threads = omp_get_max_threads();
  std::size_t most = 4000000;
  std::string scene = "all";
  std::vector<std::string> builders = cubqlBuilders();
};

// A scene at one size with its pairs by the processor's sweep, in ascending order.
struct Cell {
  std::string scene;
  BoxSet boxes;
  std::vector<Pair> pairs;
  std::size_t borderline = 0;
};

Cell makeCell(const Scene& scene, std::size_t size, int threads) {
  Cell cell;
  cell.scene = scene.name;
  scene.fill(size, 11, cell.boxes);
  PairList found;
  Sweep<float>().find(cell.boxes, threads, found);
  cell.pairs.reserve(found.size());
  for (const Buffer<Pair>& part : found.parts)
    for (const Pair pair : part) {
      cell.borderline += isMarkedBorderline(pair);
      cell.pairs.push_back(pair & ~borderline_bit);
    }
  return cell;
}

// How many of the cell's pairs are not among some others, and the other way round. One that is
// there twice is there once too often.
struct Difference {
  std::size_t missing, extra;
};
Difference differenceOf(const Cell& cell, std::vector<Pair> found) {
  __gnu_parallel::sort(found.begin(), found.end());
  std::vector<Pair> common;
  common.reserve(cell.pairs.size());
  std::set_intersection(cell.pairs.begin(), cell.pairs.end(), found.begin(), found.end(),
                        std::back_inserter(common));
  return {cell.pairs.size() - common.size(), found.size() - common.size()};
}

// The first five of all peers, which overlap where pairs leave while others are found; the others
// are what the second and third of ours consist of.
constexpr std::array<const char*, 12> stage_columns = {
    "upload_ms", "build_ms", "query_ms",  "download_ms", "device_ms",  "classify_ms",
    "sort_ms",   "cells_ms", "search_ms", "scan_ms",     "scatter_ms", "lists_ms"};
using StageTimes = std::array<double, stage_columns.size()>;

// One way to find the pairs of a cell.
class DevicePeer {
 public:
  virtual ~DevicePeer() = default;
  virtual double find() = 0;  // ms
  // Of the last find(), in any order.
  virtual std::vector<Pair> pairs() const = 0;
  virtual StageTimes stages() const = 0;
  virtual void measureStages(bool) {}
  virtual std::string name() const = 0;
  virtual CubqlSetting setting() const { return {}; }
};

class SweepPeer : public DevicePeer {
 public:
  SweepPeer(const Cell& cell, int threads) : cell_(cell), threads_(threads) {}
  double find() override {
    const Stopwatch watch;
    finder_->find(cell_.boxes, threads_, found_);
    return watch.milliseconds();
  }
  std::vector<Pair> pairs() const override {
    std::vector<Pair> all;
    for (const Buffer<Pair>& part : found_.parts)
      for (const Pair pair : part) all.push_back(pair & ~borderline_bit);
    return all;
  }
  StageTimes stages() const override {
    const CudaStageTimes& t = finder_->times();
    return {t.upload,
            t.classify + t.sort + t.cells,
            t.search + t.scan + t.scatter + t.lists,
            t.host_pairs,
            t.device(),
            t.classify,
            t.sort,
            t.cells,
            t.search,
            t.scan,
            t.scatter,
            t.lists};
  }
  void measureStages(bool on) override { finder_->measure(on); }
  std::string name() const override { return "parallel-sap"; }

 private:
  const Cell& cell_;
  const int threads_;
  const std::unique_ptr<CudaPairFinder> finder_ = makeCudaSweep();
  PairList found_;
};

class CubqlPeer : public DevicePeer {
 public:
  CubqlPeer(std::shared_ptr<CubqlPairs> cubql, std::size_t room, const CubqlSetting& setting)
      : cubql_(std::move(cubql)), room_(room), setting_(setting) {}
  double find() override { return cubql_->find(setting_); }
  std::vector<Pair> pairs() const override {
    return {cubql_->pairs(), cubql_->pairs() + std::min(room_, cubql_->found())};
  }
  StageTimes stages() const override {
    const CubqlTimes t = cubql_->times();
    StageTimes all = {t.upload, t.build, t.query, t.download, t.build + t.query};
    std::fill(all.begin() + 5, all.end(), not_known);
    return all;
  }
  std::string name() const override { return "cubql-" + setting_.builder; }
  CubqlSetting setting() const override { return setting_; }

 private:
  const std::shared_ptr<CubqlPairs> cubql_;
  const std::size_t room_;
  const CubqlSetting setting_;
};

using Peers = std::vector<std::unique_ptr<DevicePeer>>;

Peers makePeers(const Cell& cell, const Options& options) {
  constexpr std::size_t least_in_pieces = 100000;  // boxes: less leaves in no time
  Peers peers;
  peers.push_back(std::make_unique<SweepPeer>(cell, options.threads));
  const std::size_t room = cell.pairs.size() + cell.boxes.size;
  const auto cubql = std::make_shared<CubqlPairs>(cell.boxes, room);
  for (const std::string& builder : options.builders)
    for (const int leaf : {1, 4})
      for (const int pieces : {1, 8})
        if (pieces == 1 || cell.boxes.size >= least_in_pieces)
          peers.push_back(
              std::make_unique<CubqlPeer>(cubql, room, CubqlSetting{builder, leaf, pieces}));
  return peers;
}

// A peer in a cell. One that is done has its times.
struct Outcome {
  std::string status = "ok";
  bool done = false;
  Difference difference = {0, 0};
  std::vector<double> ms;
  StageTimes stages;
  Outcome() { stages.fill(not_known); }
};

void writeRow(Csv& csv, const Cell& cell, const DevicePeer& peer, const Outcome& outcome,
              int threads) {
  Row row;
  row.add("scene", cell.scene)
      .add("n", cell.boxes.size)
      .add("peer", peer.name())
      .add("leaf", peer.setting().leaf)
      .add("pieces", peer.setting().pieces)
      .add("threads", threads)
      .add("status", outcome.status)
      .addTimes(outcome.ms)
      .add("pairs", cell.pairs.size())
      .add("borderline", cell.borderline)
      .add("missing_pairs", outcome.difference.missing)
      .add("extra_pairs", outcome.difference.extra);
  for (std::size_t i = 0; i < stage_columns.size(); ++i)
    row.add(stage_columns[i], outcome.stages[i]);
  csv.write(row);
}

// What peers took in smaller cells of the scene, to leave those out that would take too long: at
// worst the time grows with the square of the number of boxes.
class Limit {
 public:
  bool lets(const DevicePeer& peer, std::size_t size) const {
    constexpr double most_ms = 1500;
    const auto known = known_.find(keyOf(peer));
    if (known == known_.end()) return true;
    const auto& [smaller, ms] = known->second;
    const double times = static_cast<double>(size) / static_cast<double>(smaller);
    return ms * times * times <= most_ms;
  }
  void note(const DevicePeer& peer, std::size_t size, double ms) {
    known_[keyOf(peer)] = {size, ms};
  }

 private:
  static std::string keyOf(const DevicePeer& peer) {
    return peer.name() + " " + std::to_string(peer.setting().leaf);
  }
  std::map<std::string, std::pair<std::size_t, double>> known_;
};

// The least of the first frames, in which memory and kernels come to the device; one that is slow
// is not given all of them.
double warmUp(DevicePeer& peer) {
  double least = peer.find();
  for (int frame = 1; frame < 4 && (frame == 1 || least < slow_ms); ++frame)
    least = std::min(least, peer.find());
  return least;
}

// Compares each peer's pairs. Of a slow one the frames for that are all.
std::vector<Outcome> check(const Cell& cell, const Peers& peers, Limit& limit) {
  std::vector<Outcome> outcomes(peers.size());
  for (std::size_t i = 0; i < peers.size(); ++i) {
    Outcome& outcome = outcomes[i];
    if (!limit.lets(*peers[i], cell.boxes.size)) {
      outcome.status = "left out: too slow at a smaller size";
      outcome.done = true;
      continue;
    }
    const double ms = warmUp(*peers[i]);
    limit.note(*peers[i], cell.boxes.size, ms);
    outcome.difference = differenceOf(cell, peers[i]->pairs());
    if (outcome.difference.missing || outcome.difference.extra) outcome.status = wrong;
    outcome.done = outcome.status == wrong || ms > slow_ms;
    if (outcome.status != wrong && outcome.done) outcome.ms = {ms};
  }
  return outcomes;
}

// Frames of a peer follow each other, the first of each few is not counted. All peers take turns at
// that, every other time the other way round.
void takeTurns(const Peers& peers, std::vector<Outcome>& outcomes) {
  constexpr int counted = 3;
  constexpr std::size_t enough = 15, most = 60;
  constexpr double budget_ms = 150;  // in a cell, for each peer
  std::vector<double> spent_ms(peers.size(), 0);
  const auto isDone = [&](std::size_t i) {
    const std::size_t samples = outcomes[i].ms.size();
    return outcomes[i].done || samples >= most || (samples >= enough && spent_ms[i] >= budget_ms);
  };
  bool all_done = false;
  for (int turn = 0; !all_done; ++turn) {
    all_done = true;
    for (std::size_t at = 0; at < peers.size(); ++at) {
      const std::size_t i = turn % 2 ? peers.size() - 1 - at : at;
      if (isDone(i)) continue;
      all_done = false;
      spent_ms[i] += peers[i]->find();
      for (int frame = 0; frame < counted && !isDone(i); ++frame) {
        outcomes[i].ms.push_back(peers[i]->find());
        spent_ms[i] += outcomes[i].ms.back();
      }
    }
  }
}

void takeStages(DevicePeer& peer, Outcome& outcome) {
  const int frames = outcome.done ? 1 : 9;
  std::array<std::vector<double>, stage_columns.size()> all;
  peer.measureStages(true);
  for (int frame = 0; frame < frames; ++frame) {
    peer.find();
    const StageTimes times = peer.stages();
    for (std::size_t i = 0; i < all.size(); ++i) all[i].push_back(times[i]);
  }
  peer.measureStages(false);
  for (std::size_t i = 0; i < all.size(); ++i) outcome.stages[i] = median(all[i]);
}

// Whether all pairs were right.
bool recordCell(const Cell& cell, const Options& options, Limit& limit, Csv& csv) {
  const Peers peers = makePeers(cell, options);
  std::vector<Outcome> outcomes = check(cell, peers, limit);
  takeTurns(peers, outcomes);
  bool right = true;
  for (std::size_t i = 0; i < peers.size(); ++i) {
    if (!outcomes[i].ms.empty()) takeStages(*peers[i], outcomes[i]);
    right = outcomes[i].status != wrong && right;
    writeRow(csv, cell, *peers[i], outcomes[i], options.threads);
  }
  std::fprintf(stderr, "%s %zu%s\n", cell.scene.c_str(), cell.boxes.size, right ? "" : ": wrong");
  return right;
}

// `exact` and `filtered` are the cube with what cuBQL knows nothing of; what it does with the
// bounds of `strange` is not defined.
bool isForAll(const Scene& scene) {
  return scene.name != "exact" && scene.name != "filtered" && scene.name != "strange";
}

bool recordAll(const Options& options) {
  Csv csv({options.csv});
  bool right = true;
  for (const Scene& scene : cuda_check::scenes()) {
    if (!isForAll(scene) || (options.scene != "all" && options.scene != scene.name)) continue;
    const std::size_t largest = scene.name == "cube" ? 4000000 : 1000000;
    const std::size_t most = std::min({options.most, scene.most, largest});
    Limit limit;
    std::size_t last = 0;
    for (const std::size_t wanted : {10000, 100000, 1000000, 4000000}) {
      const std::size_t size = std::min(wanted, most);
      if (size == last) break;
      last = size;
      right = recordCell(makeCell(scene, size, options.threads), options, limit, csv) && right;
    }
  }
  return right;
}

}  // namespace
}  // namespace bench

int main(int count, char** arguments) {
  bench::Options options;
  if (count < 2) {
    std::printf("usage: %s <file> [threads] [most boxes] [scene|all] [builder...]\nbuilders:",
                arguments[0]);
    for (const std::string& builder : bench::cubqlBuilders()) std::printf(" %s", builder.c_str());
    std::printf("\n");
    return 2;
  }
  options.csv = arguments[1];
  if (count > 2) options.threads = std::atoi(arguments[2]);
  if (count > 3) options.most = std::strtoull(arguments[3], nullptr, 10);
  if (count > 4) options.scene = arguments[4];
  if (count > 5) options.builders.assign(arguments + 5, arguments + count);
  std::string why;
  if (ode_parallel_sap::cudaDevices(&why).empty()) {
    std::printf("skipped: %s\n", why.c_str());
    return 77;
  }
  return bench::recordAll(options) ? 0 : 1;
}
