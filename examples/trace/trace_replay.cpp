// Replays a trace: what is in it, whether its pairs are those of the program, and what each option
// of the space would give that program.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "replay_timing.h"

namespace {

struct Options {
  std::string file, csv;
  bool check = false;
  std::vector<int> threads;         // to be tried, ascending
  std::vector<double> tolerances;   // lengths
  std::vector<int> devices;         // GPUs
  std::vector<std::string> spaces;  // of ODE's, to compare with
  int turns = 3;                    // how often the trace is played for a row
  int contacts = 8;                 // of a pair at most; 0: no rows with dCollide
};

struct Row {
  std::string option;
  trace::Setting setting;
  trace::Timing timing;
};

const char* classOf(const trace::Geom& geom) {
  static const char* const names[] = {"sphere",  "box",        "capsule",     "cylinder",
                                      "plane",   "ray",        "convex hull", "geom transform",
                                      "trimesh", "heightfield"};
  if (geom.is(trace::format::space)) return "space";
  return geom.geom_class < std::size(names) ? names[geom.geom_class] : "user's class";
}

void describe(const trace::Recording& recording) {
  std::map<std::string, std::size_t> classes;
  std::size_t with_pairs = 0;
  std::map<std::uint32_t, std::string> geoms;  // a geom may be written many times
  for (const trace::Frame& frame : recording.frames) {
    for (const trace::Geom& geom : frame.geoms) geoms[geom.number] = classOf(geom);
    with_pairs += frame.pairs.has_value();
  }
  for (const auto& geom : geoms) ++classes[geom.second];
  std::printf("%s: %zu frames, every %u of the program's, %s precision, %zu geoms:",
              recording.name.c_str(), recording.frames.size(), recording.header.every,
              recording.header.real_bytes == 8 ? "double" : "single", geoms.size());
  const char* separator = "";
  for (const auto& one : classes) {
    std::printf("%s %zu %s", separator, one.second, one.first.c_str());
    separator = ",";
  }
  std::printf(
      "\n%zu frames tell the program's pairs; %zu geoms get other bounding boxes from this "
      "ODE and are shown by those that were written\n",
      with_pairs, recording.by_bounds.size());
}

// Replays the program's own frames. False where their pairs are others.
bool check(const trace::Recording& recording) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  std::size_t same = 0, other = 0, unknown = 0;
  {
    trace::Player player(recording, space);
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
      const trace::Frame& frame = player.advance();
      trace::setAsTraced(space, frame);
      const trace::PairTotals found = trace::collide(space);
      if (!frame.pairs) {
        ++unknown;
      } else if (found == *frame.pairs) {
        ++same;
      } else if (++other == 1) {
        std::fprintf(stderr, "collide %llu: %llu pairs here, %llu in the program%s\n",
                     static_cast<unsigned long long>(frame.collide),
                     static_cast<unsigned long long>(found.count),
                     static_cast<unsigned long long>(frame.pairs->count),
                     found.count == frame.pairs->count ? ", but not the same ones" : "");
      }
    }
  }
  dSpaceDestroy(space);
  std::printf("%zu frames have the program's pairs, %zu have others, of %zu it is not known\n",
              same, other, unknown);
  return other == 0;
}

// The first row is the space as the program has set it, on the first number of threads.
std::vector<Row> rowsFor(const Options& options) {
  std::vector<Row> rows;
  trace::Setting usual;
  usual.threads = options.threads.front();
  usual.turns = options.turns;
  usual.contacts = options.contacts;
  const auto add = [&](const std::string& name, const auto& change) {
    rows.push_back({name, usual, {}});
    change(rows.back().setting);
  };
  const auto addThreads = [&](const char* name, trace::Work work) {
    for (const int threads : options.threads)
      add(name, [&](trace::Setting& setting) {
        setting.threads = threads;
        setting.work = work;
      });
  };
  addThreads("as traced", trace::Work::pairs);
  add("pairs of static geoms skipped", [](trace::Setting& setting) { setting.skip_static = true; });
  add("pairs asleep skipped", [](trace::Setting& setting) { setting.skip_asleep = true; });
  add("planes culled", [](trace::Setting& setting) { setting.cull_planes = true; });
  for (const double tolerance : options.tolerances) {
    char name[64];
    std::snprintf(name, sizeof name, "tolerance %g", tolerance);
    add(name, [&](trace::Setting& setting) { setting.tolerance = tolerance; });
  }
  for (const int devices : options.devices)
    add(std::to_string(devices) + " GPUs", [&](trace::Setting& setting) {
      setting.devices = devices;
      setting.threads = options.threads.back();
    });
  for (const std::string& space : options.spaces)
    add("ODE's " + space + " space", [&](trace::Setting& setting) { setting.space = space; });
  if (options.contacts > 0) {
    add("dCollide in the callback",
        [](trace::Setting& setting) { setting.work = trace::Work::loop; });
    addThreads("parallel contacts", trace::Work::contacts);
  }
  return rows;
}

// Each is compared with the first row that does the same work.
void print(const std::vector<Row>& rows) {
  std::printf("\n%-32s %7s %12s %12s %12s %12s %8s\n", "option", "threads", "ms a frame", "least",
              "pairs", "contacts", "times");
  for (const Row& row : rows) {
    const trace::Timing& timing = row.timing;
    const Row& base = *std::find_if(rows.begin(), rows.end(), [&](const Row& one) {
      return (one.setting.work == trace::Work::pairs) == (row.setting.work == trace::Work::pairs);
    });
    std::printf("%-32s %7d %12.4f %12.4f %12.1f %12.1f %8.2f\n", row.option.c_str(),
                row.setting.threads, timing.median_ms, timing.least_ms, timing.pairs,
                timing.contacts, base.timing.median_ms / timing.median_ms);
  }
}

void writeCsv(const std::string& path, const std::vector<Row>& rows) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (!file) throw std::runtime_error("cannot write the file " + path);
  std::fprintf(file, "option,threads,collides,median_ms,least_ms,pairs,contacts\n");
  for (const Row& row : rows)
    std::fprintf(file, "%s,%d,%d,%.6g,%.6g,%.8g,%.8g\n", row.option.c_str(), row.setting.threads,
                 int{row.setting.work != trace::Work::pairs}, row.timing.median_ms,
                 row.timing.least_ms, row.timing.pairs, row.timing.contacts);
  const bool written = !std::ferror(file);
  if (std::fclose(file) != 0 || !written) throw std::runtime_error("cannot write the file " + path);
}

int run(const Options& options) {
  const trace::Recording recording = trace::readRecording(options.file);
  describe(recording);
  if (options.check) return check(recording) ? 0 : 1;
  std::vector<Row> rows = rowsFor(options);
  for (Row& row : rows) row.timing = trace::measure(recording, row.setting);
  print(rows);
  if (!options.csv.empty()) writeCsv(options.csv, rows);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  const int all = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (int threads = 1; threads < all; threads *= 2) options.threads.push_back(threads);
  options.threads.push_back(all);
  CLI::App app("trace-replay: what is in a trace, and what each option would give its program");
  app.add_option("file", options.file, "what dParallelSAPSpaceSetTrace wrote")->required();
  app.add_flag("--check", options.check, "only whether its pairs are those of the program");
  app.add_option("--threads", options.threads)
      ->delimiter(',')
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--tolerance", options.tolerances, "lengths to try")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 1e30));
  app.add_option("--devices", options.devices, "numbers of GPUs to try")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app.add_option("--spaces", options.spaces, "of ODE's, to compare with")
      ->delimiter(',')
      ->check(CLI::IsMember({"hash", "sap", "simple"}));
  app.add_option("--turns", options.turns, "times the trace is played for a row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--contacts", options.contacts, "of a pair at most; 0: no rows of contacts")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--csv", options.csv, "the table as a file, too");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;  // 0: the help that was asked for
  }
  std::sort(options.threads.begin(), options.threads.end());
  dInitODE2(0);
  int result = 2;
  try {
    result = run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "trace-replay: %s\n", error.what());
  }
  dCloseODE();
  return result;
}
