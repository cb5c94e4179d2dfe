// What each call and option of the parallel space gives in a warehouse of robots. See README.md.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <optional>

#include "warehouse.h"

namespace scene {
namespace {

struct Way {
  const char *flag, *what;
  bool Ways::*member;
};
constexpr Way ways[] = {{"--rays", "rays in a batch", &Ways::rays},
                        {"--overlaps", "probes in a batch", &Ways::overlaps},
                        {"--contacts", "parallel contacts", &Ways::contacts},
                        {"--skip-static", "static pairs skipped", &Ways::skip_static},
                        {"--skip-asleep", "asleep pairs skipped", &Ways::skip_asleep},
                        {"--notified", "changes notified", &Ways::notified},
                        {"--layers", "categories as layers", &Ways::layers},
                        {"--apart", "static world apart", &Ways::apart}};

struct Options {
  Plan plan;
  int frames = 5;
  bool check = false;
  std::string picture;
};

// Throws CLI::ParseError.
void read(CLI::App& app, int argc, char** argv, Options& options) {
  app.add_option("--shelves", options.plan.shelves, "static boxes")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  app.add_option("--space", options.plan.space, "space of the first row")
      ->check(CLI::IsMember({"hash", "simple", "sap", "parallel-sap"}))
      ->capture_default_str();
  app.add_option("--frames", options.frames, "frames, after one that is not timed")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--threads", options.plan.threads, "of the parallel space; 0: OpenMP's")
      ->check(CLI::Range(0, 256));
  app.add_flag("--check", options.check, "compare what all rows find");
#ifdef SCENE_TEXTURES
  app.add_option("--picture", options.picture, "PNG file: draws the last frame into it")
      ->check([](const std::string& file) {
        return std::ofstream(file, std::ios::app) ? "" : "cannot write the file " + file;
      });
#endif
  for (const Way& way : ways)
    app.add_flag(way.flag, options.plan.ways.*way.member, std::string("only: ") + way.what);
  app.parse(argc, argv);
}

class Table {
 public:
  explicit Table(const Options& options) : options_(options) {
    std::printf("%-22s %9s %9s %9s %9s %7s %8s %6s %6s %6s\n", "ms a frame", "collide", "lidar",
                "planner", "all", "faster", "pairs", "cont.", "hits", "free");
  }

  // False if the check finds a difference.
  bool add(const std::string& name, const Plan& plan) {
    Warehouse warehouse(plan);
    std::vector<Work> frames;
    for (int i = 0; i <= options_.frames; ++i) {
      frames.push_back(warehouse.frame());
      if (options_.check && !isRight(name, plan, static_cast<std::size_t>(i), warehouse.answers()))
        return false;
    }
    const Work last = frames.back();
    frames.erase(frames.begin());
    std::sort(frames.begin(), frames.end(),
              [](const Work& a, const Work& b) { return a.total() < b.total(); });
    const Work& median = frames[frames.size() / 2];
    if (!first_) first_ = median.total();
    std::printf("%-22s %9.3f %9.3f %9.3f %9.3f %6.1fx %8llu %6zu %6zu %6zu\n", name.c_str(),
                median.ms[Work::Collide], median.ms[Work::Lidar], median.ms[Work::Planner],
                median.total(), *first_ / median.total(), last.pairs, last.contacts, last.hits,
                last.free);
    std::fflush(stdout);
    return true;
  }

  void printChecked() const {
    std::size_t pairs = 0;
    for (const Answers& answers : right_) pairs += answers.pairs.size();
    std::printf(
        "Checked: all rows have the same %zu pairs, ray distances and free poses in %zu frames.\n",
        pairs, right_.size());
  }

 private:
  // The first row's answers are those that all must give.
  bool isRight(const std::string& name, const Plan& plan, std::size_t frame, Answers&& answers) {
    if (frame == right_.size()) right_.push_back(answers);
    const Answers& right = right_[frame];
    const char* const wrong = !plan.ways.contacts && answers.pairs != right.pairs ? "pairs"
                              : answers.touching != right.touching                ? "touching pairs"
                              : answers.distances != right.distances              ? "ray distances"
                              : answers.free != right.free                        ? "free poses"
                                                                                  : nullptr;
    if (!wrong) return true;
    std::fflush(stdout);
    std::fprintf(stderr, "scene: frame %zu: %s: other %s than in the first row\n", frame,
                 name.c_str(), wrong);
    return false;
  }

  const Options& options_;
  std::vector<Answers> right_;
  std::optional<double> first_;
};

bool run(const Options& options) {
  Table table(options);
  Plan plan = options.plan;
  plan.ways = {};
  if (plan.space != "parallel-sap" && !table.add(plan.space, plan)) return false;
  plan.space = "parallel-sap";
  if (!table.add("the one line", plan)) return false;
  Ways most;
  bool any = false;
  for (const Way& way : ways) any |= options.plan.ways.*way.member;
  for (const Way& way : ways) {
    plan.ways = {};
    plan.ways.*way.member = true;
    most.*way.member = way.member != &Ways::apart;
    if (!any && !table.add(way.what, plan)) return false;
  }
  plan.ways = any ? options.plan.ways : most;
  if (!table.add(any ? "what was asked for" : "all in one space", plan)) return false;
  if (options.check) table.printChecked();
#ifdef SCENE_TEXTURES
  if (options.picture.empty()) return true;
  Warehouse warehouse(plan);
  for (int i = 0; i <= options.frames; ++i) warehouse.frame();
  draw(warehouse, options.picture);
#endif
  return true;
}

}  // namespace
}  // namespace scene

int main(int argc, char** argv) {
  CLI::App app("A warehouse of robots in ODE's spaces, and what the parallel space gives");
  scene::Options options;
  try {
    scene::read(app, argc, argv, options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) ? 2 : 0;
  }
  dInitODE2(0);
  bool is_right = false;
  try {
    is_right = scene::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scene: %s\n", error.what());
  }
  dCloseODE();
  return is_right ? 0 : 1;
}
