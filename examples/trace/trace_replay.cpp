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

#include "options_table.h"
#include "player.h"

namespace {

struct Options {
  std::string file, csv;
  bool check = false, pairs = false;
  trace::TableWishes table;
};

struct Listed {
  trace::PairTotals totals;
  bool print;
};

void takePair(void* data, dGeomID a, dGeomID b) {
  Listed& listed = *static_cast<Listed*>(data);
  const std::uint32_t first = trace::Player::numberOf(a), second = trace::Player::numberOf(b);
  listed.totals.add(first, second);
  if (listed.print) std::printf(" %u-%u", first, second);
}

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
bool check(const trace::Recording& recording, bool print) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  std::size_t same = 0, other = 0, unknown = 0;
  {
    trace::Player player(recording, space);
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
      const trace::Frame& frame = player.advance();
      trace::setAsTraced(space, frame);
      Listed listed = {{}, print};
      if (print) std::printf("collide %llu:", static_cast<unsigned long long>(frame.collide));
      dSpaceCollide(space, &listed, takePair);
      if (print) std::printf("\n");
      if (!frame.pairs) {
        ++unknown;
      } else if (listed.totals == *frame.pairs) {
        ++same;
      } else if (++other == 1) {
        std::fprintf(stderr, "collide %llu: %llu pairs here, %llu in the program%s\n",
                     static_cast<unsigned long long>(frame.collide),
                     static_cast<unsigned long long>(listed.totals.count),
                     static_cast<unsigned long long>(frame.pairs->count),
                     listed.totals.count == frame.pairs->count ? ", but not the same ones" : "");
      }
    }
  }
  dSpaceDestroy(space);
  if (!print)
    std::printf("%zu frames have the program's pairs, %zu have others, of %zu it is not known\n",
                same, other, unknown);
  return other == 0;
}

void print(const std::vector<trace::TableRow>& rows) {
  std::printf("\n%-32s %7s %12s %12s %12s %12s %8s\n", "option", "threads", "ms a frame", "least",
              "pairs", "contacts", "times");
  for (const trace::TableRow& row : rows) {
    const trace::Timing& timing = row.timing;
    std::printf("%-32s %7d %12.4f %12.4f %12.1f %12.1f %8.2f\n", row.option.c_str(),
                row.setting.threads, timing.median_ms, timing.least_ms, timing.pairs,
                timing.contacts, trace::baseOf(rows, row).timing.median_ms / timing.median_ms);
  }
}

void writeCsv(const std::string& path, const std::vector<trace::TableRow>& rows) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (!file) throw std::runtime_error("cannot write the file " + path);
  std::fprintf(file, "option,threads,collides,median_ms,least_ms,pairs,contacts\n");
  for (const trace::TableRow& row : rows)
    std::fprintf(file, "%s,%d,%d,%.6g,%.6g,%.8g,%.8g\n", row.option.c_str(), row.setting.threads,
                 int{row.setting.work != trace::Work::pairs}, row.timing.median_ms,
                 row.timing.least_ms, row.timing.pairs, row.timing.contacts);
  const bool written = !std::ferror(file);
  if (std::fclose(file) != 0 || !written) throw std::runtime_error("cannot write the file " + path);
}

int run(Options& options) {
  const trace::Recording recording = trace::readRecording(options.file);
  if (options.pairs) return check(recording, true) ? 0 : 1;
  describe(recording);
  if (options.check) return check(recording, false) ? 0 : 1;
  const std::vector<trace::TableRow> rows = trace::measureOptions(recording, options.table);
  print(rows);
  if (!options.csv.empty()) writeCsv(options.csv, rows);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  const int all = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (int threads = 1; threads < all; threads *= 2) options.table.threads.push_back(threads);
  options.table.threads.push_back(all);
  CLI::App app("trace-replay: what is in a trace, and what each option would give its program");
  app.add_option("file", options.file, "what dParallelSAPSpaceSetTrace wrote")->required();
  app.add_flag("--check", options.check, "only whether its pairs are those of the program");
  app.add_flag("--pairs", options.pairs, "only the pairs of each frame, by the geoms' numbers");
  app.add_option("--threads", options.table.threads)
      ->delimiter(',')
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--tolerance", options.table.tolerances, "lengths to try")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 1e30));
  app.add_option("--devices", options.table.devices, "numbers of GPUs to try")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app.add_option("--spaces", options.table.spaces, "of ODE's, to compare with")
      ->delimiter(',')
      ->check(CLI::IsMember({"hash", "sap", "simple"}));
  app.add_option("--turns", options.table.turns, "times the trace is played for a row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--contacts", options.table.contacts, "of a pair at most; 0: no rows of contacts")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--csv", options.csv, "the table as a file, too");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;  // 0: the help that was asked for
  }
  std::sort(options.table.threads.begin(), options.table.threads.end());
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
