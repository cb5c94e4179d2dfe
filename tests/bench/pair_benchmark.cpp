// Who finds the overlapping pairs of moving boxes in what time? One cell is a scene, a number of
// boxes, a peer and a number of threads; those of a scene and size run in turn.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>

#include "bench_scenes.h"
#include "pair_check.h"
#include "peer.h"
#include "program.h"
#include "random.h"

namespace bench {

std::vector<PeerKind>& peerKinds() {
  static std::vector<PeerKind> kinds;
  return kinds;
}

namespace {

constexpr int frames_before_check = 3;
constexpr std::uint64_t seed = 1;
// Of batches, no two alike: a few that came again and again would teach a processor by heart which
// boxes of a small scene overlap.
constexpr int frames_in_store = 512;

struct Wishes {
  std::vector<std::string> scenes{"dense-cube"};
  std::vector<std::string> peers;  // empty: all
  std::vector<std::size_t> sizes{1000, 10000, 100000};
  std::vector<int> threads{1};
  int batch = 0;               // frames in one clock reading; 0: each find has its own
  double moving = 1;           // part of the boxes that moves
  double sleep = 0, work = 0;  // ms between frames
  int others = -1;             // processes beside this one; shown if not negative
  double limit = 60;           // seconds that one find may take
  std::string piles, trace;
  bool list = false;
  Timing timing;
};

// One scene at one size: what its cells share.
struct Stage {
  const SceneKind& scene;
  std::size_t n;
  std::optional<Overlapping> expected{};  // in the frame that is checked
};

// What was measured in a cell, over all its turns.
struct Cell {
  Stage& stage;
  const PeerKind& kind;
  int threads;
  std::vector<double> times{};  // ms
  std::vector<Account> accounts{};
  std::size_t extra = 0;
  double move_ms = not_known;
  std::string status{};  // empty: ok

  std::string name() const {
    return stage.scene.name + "/" + kind.name + "/" + std::to_string(threads);
  }
  double square() const { return std::pow(double(stage.n), 2); }
  PairSet expected() const {
    if (!stage.expected) return {};
    return kind.leaves_out_rest ? stage.expected->of_moved : stage.expected->all;
  }
};

// Seconds of one find over the square of the number of boxes, by Cell::name: time grows with that
// at worst.
using Forecast = std::map<std::string, double>;

// A peer in action.
class Turn {
 public:
  Turn(Cell& cell, const Wishes& wishes)
      : cell_(cell),
        wishes_(wishes),
        scene_(partlyMoving(cell.stage.scene.make(cell.stage.n, seed), wishes.moving)),
        peer_(cell.kind.create(cell.threads)) {
    peer_->create(scene_.boxes);
    if (wishes.batch > 0) cell.move_ms = 0;
    if (wishes.batch > 0 && wishes.moving > 0) {
      storeFrames();
      measureMoving();
    }
    peer_->enter();
    for (int i = 0; i < frames_before_check; ++i) findNext();
    check();
  }

  void play() {
    if (!cell_.status.empty()) return;
    is_timed_ = true;
    Timing timing = wishes_.timing;
    timing.seconds /= std::max(wishes_.batch, 1);
    timeFrames(cell_.times, 0, timing, [this] {
      if (wishes_.batch > 0) return playBatch(true) - cell_.move_ms;
      const double milliseconds = findNext();
      cell_.accounts.push_back(peer_->account());
      return milliseconds;
    });
    // A space that was asked times its stages from then on, which takes as long as a few geoms do.
    if (wishes_.batch > 0) cell_.accounts.push_back(peer_->account());
  }

 private:
  // Milliseconds of one find, after what a program does between frames.
  double findNext() {
    advance();
    if (is_timed_) {
      std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(wishes_.sleep));
      for (const Stopwatch clock; clock.milliseconds() < wishes_.work;) continue;
    }
    const Stopwatch clock;
    peer_->find(nullptr);
    return clock.milliseconds();
  }

  // Milliseconds of a frame, moving included, as the mean of a batch.
  double playBatch(bool finds) {
    const Stopwatch clock;
    for (int i = 0; i < wishes_.batch; ++i) {
      if (wishes_.moving > 0) peer_->move(frames_[next_frame_++ % frames_.size()]);
      if (finds) peer_->find(nullptr);
    }
    return clock.milliseconds() / wishes_.batch;
  }

  // Where nothing moves the first frames tell so, and the timed ones tell nothing.
  void advance() {
    if (wishes_.moving == 0 && is_timed_) return;
    if (wishes_.moving > 0) scene_.next();
    peer_->move(scene_.boxes);
  }

  // Boxes tremble as well, by up to a twentieth of their width.
  void storeFrames() {
    sap_test::Random random(seed);
    for (int i = 0; i < frames_in_store; ++i) {
      scene_.next();
      frames_.push_back(scene_.boxes);
      for (CentredBox& box : frames_.back())
        for (int axis = 0; axis < 3; ++axis)
          box.centre[axis] += box.half[axis] * static_cast<dReal>(random.between(-0.1, 0.1));
    }
  }

  // The same calls while the user's objects are in no structure yet.
  void measureMoving() {
    std::vector<double> times;
    for (int round = 0; round < 20; ++round) times.push_back(playBatch(false));
    cell_.move_ms = median(times);
  }

  void check() {
    const Boxes before = scene_.boxes;
    advance();
    if (!cell_.stage.expected) cell_.stage.expected = overlapping(before, scene_.boxes);
    cell_.extra = 0;
    cell_.status =
        faultOf(*peer_, scene_.boxes, cell_.expected(), !cell_.kind.superset.empty(), cell_.extra);
  }

  Cell& cell_;
  const Wishes& wishes_;
  MovingScene scene_;
  const std::unique_ptr<Peer> peer_;
  std::vector<Boxes> frames_;
  std::size_t next_frame_ = 0;
  bool is_timed_ = false;
};

Row rowOf(const Cell& cell, const Wishes& wishes) {
  const auto stage = [&](double Account::*member) {
    std::vector<double> values;
    for (const Account& account : cell.accounts) values.push_back(account.*member);
    return median(values);
  };
  const Account last = cell.accounts.empty() ? Account() : cell.accounts.back();
  const auto used = [&](int number) { return cell.times.empty() ? "" : std::to_string(number); };
  Row row;
  row.add("scene", cell.stage.scene.name)
      .add("n", cell.stage.n)
      .add("peer", cell.kind.name)
      .add("library", cell.kind.library)
      .add("threads", cell.threads)
      .add("moving", wishes.moving)
      .add("status", cell.status.empty() ? "ok" : cell.status)
      .addTimes(cell.times)
      .add("move_ms", cell.move_ms)
      .add("pairs", cell.expected().count)
      .add("extra_pairs", cell.extra)
      .add("update_ms", stage(&Account::update))
      .add("extract_ms", stage(&Account::extract))
      .add("filter_ms", stage(&Account::filter))
      .add("report_ms", stage(&Account::report))
      .add("own_bytes", last.own_bytes)
      .add("threads_used", used(last.threads))
      .add("devices_used", used(last.devices));
  if (wishes.others >= 0)
    row.add("others", wishes.others).add("sleep_ms", wishes.sleep).add("work_ms", wishes.work);
  return row;
}

void takeTurn(Cell& cell, const Forecast& forecast, const Wishes& wishes) {
  if (!cell.status.empty()) return;
  const auto known = forecast.find(cell.name());
  const double seconds = known == forecast.end() ? 0 : known->second * cell.square();
  if (seconds > wishes.limit) {
    cell.status = "left out: might take " + std::to_string(std::lround(seconds)) + " s";
    return;
  }
  try {
    Turn(cell, wishes).play();
  } catch (const std::exception& error) {
    cell.status = std::string("left out: ") + error.what();
  }
}

std::vector<SceneKind> allScenes(const Wishes& wishes) {
  std::vector<SceneKind> all = sceneKinds(wishes.piles);
  if (!wishes.trace.empty()) all.push_back(traceScene(wishes.trace));
  return all;
}

// Those of these names, in the order of all; what is missing is said.
template <class Kind>
std::vector<Kind> chosen(const std::vector<Kind>& all, const std::vector<std::string>& names) {
  std::vector<Kind> found;
  std::set<std::string> missing(names.begin(), names.end());
  for (const Kind& kind : all)
    if (missing.erase(kind.name)) found.push_back(kind);
  for (const std::string& name : missing)
    std::fprintf(stderr, "pair-benchmark: no %s here; see --list\n", name.c_str());
  return found;
}

// Those that are to be had here.
std::vector<PeerKind> allPeers() {
  std::vector<PeerKind> all;
  for (const PeerKind& kind : peerKinds())
    if (kind.create(1)) all.push_back(kind);
  return all;
}

void printList(const Wishes& wishes) {
  std::printf("Scenes\n");
  for (const SceneKind& scene : allScenes(wishes))
    std::printf("  %-22s %s\n", scene.name.c_str(), scene.about.c_str());
  std::printf("Peers\n");
  for (const PeerKind& kind : allPeers())
    std::printf("  %-30s %s%s%s\n", kind.name.c_str(), kind.library.c_str(),
                kind.superset.empty() ? "" : "; ", kind.superset.c_str());
}

// Peers that take no number of threads run once, on the first of all numbers that is one.
bool runsOn(const PeerKind& kind, int threads, const std::vector<int>& all) {
  if (threads == 0) return kind.chooses_threads;
  const auto first = std::find_if(all.begin(), all.end(), [](int number) { return number > 0; });
  return kind.takes_threads || threads == *first;
}

// Whether ours found what it should have. What another library finds or misses is its own affair,
// and a finding; it was not timed.
bool runScene(Stage stage, const std::vector<PeerKind>& peers, const Wishes& wishes,
              Forecast& forecast, Csv& csv) {
  std::vector<Cell> cells;
  for (const int threads : wishes.threads)
    for (const PeerKind& kind : peers)
      if (stage.n <= kind.most && runsOn(kind, threads, wishes.threads))
        cells.push_back({stage, kind, threads});
  for (int round = 0; round < wishes.timing.rounds; ++round)
    for (Cell& cell : cells) takeTurn(cell, forecast, wishes);
  bool right = true;
  for (const Cell& cell : cells) {
    if (!cell.times.empty())
      forecast[cell.name()] =
          *std::min_element(cell.times.begin(), cell.times.end()) / 1000 / cell.square();
    csv.write(rowOf(cell, wishes));
    if (cell.kind.name.rfind("parallel-sap", 0) == 0 && cell.status.rfind("wrong", 0) == 0)
      right = false;
  }
  return right;
}

void run(Wishes wishes) {
  if (wishes.list) return printList(wishes);
  const std::vector<SceneKind> scenes = chosen(allScenes(wishes), wishes.scenes);
  if (scenes.size() != wishes.scenes.size()) throw std::invalid_argument("not all scenes are here");
  if (wishes.peers.empty())  // ours with its own choice of method only
    for (const PeerKind& kind : allPeers())
      if (kind.name.find(':') == std::string::npos) wishes.peers.push_back(kind.name);
  const std::vector<PeerKind> peers = chosen(allPeers(), wishes.peers);
  Csv csv(wishes.timing.csv);
  Forecast forecast;
  bool right = true;
  std::sort(wishes.sizes.begin(), wishes.sizes.end());
  for (const SceneKind& scene : scenes)
    for (std::size_t n : scene.always ? std::vector<std::size_t>{scene.always} : wishes.sizes)
      if (n <= scene.most) right = runScene({scene, n}, peers, wishes, forecast, csv) && right;
  if (!right) throw std::runtime_error("wrong pairs");
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  wishes.piles = std::filesystem::absolute(argv[0]).parent_path();
  bench::Program program("pair-benchmark: time to find the overlapping pairs of moving boxes");
  program.add_option("--scenes", wishes.scenes, "what is in motion")->delimiter(',');
  program.add_option("--sizes", wishes.sizes, "boxes")->delimiter(',');
  program.add_option("--peers", wishes.peers, "who finds the pairs; default: all there are")
      ->delimiter(',');
  program
      .add_option("--threads", wishes.threads,
                  "for the peers that take a number of threads; 0: as many as a user gets who sets "
                  "none, for ours only")
      ->delimiter(',');
  program.add_option("--batch", wishes.batch, "frames in one clock reading: for small scenes");
  program.add_option(
      "--moving", wishes.moving,
      "part of the boxes that moves, always the same ones; 0: no peer gets boxes again");
  program.add_option("--sleep", wishes.sleep, "ms of sleep between frames");
  program.add_option("--work", wishes.work, "ms of other work between frames, on one thread");
  program.add_option("--others", wishes.others,
                     "as how many busy processes there are beside it rows say");
  program.add_option("--limit", wishes.limit,
                     "leave out what would need more seconds for one find");
  program.add_option("--piles", wishes.piles, "where record-piles wrote");
  program.add_option("--trace", wishes.trace,
                     "the scene \"trace\": what dParallelSAPSpaceSetTrace wrote");
  program.add_flag("--list", wishes.list, "names of scenes and peers, and what they are");
  program.addTiming(wishes.timing);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
