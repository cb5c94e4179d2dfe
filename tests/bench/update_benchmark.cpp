// Bringing the AABBs of geoms that all move up to date, against a bare loop that reads the same
// cache lines: a geom's own, and those of its pose.
#include <malloc.h>
#include <ode_parallel_sap/parallel_sap_space.h>
#include <omp.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "counting.h"
#include "csv.h"
#include "moving_cubes.h"
#include "program.h"

namespace bench {
namespace {

struct Wishes {
  std::vector<std::size_t> sizes{10000, 100000, 1000000};
  std::vector<int> threads{1};
  bool bodies = false, scattered = false;
  double seconds = 1;  // of frames, a cell
  CsvFile csv;
};

constexpr std::uintptr_t line_bytes = 64;

// The cache lines of a geom and of its pose: where they begin, and how many there are.
struct Lines {
  const char* begin;
  int count;
};
Lines linesOf(const void* object, std::size_t size) {
  const std::uintptr_t first = reinterpret_cast<std::uintptr_t>(object) & ~(line_bytes - 1);
  const std::uintptr_t last = reinterpret_cast<std::uintptr_t>(object) + size - 1;
  return {reinterpret_cast<const char*>(first), static_cast<int>((last - first) / line_bytes + 1)};
}

class Reader {
 public:
  explicit Reader(dSpaceID space) {
    // A pose is a place and a matrix, and begins with the place.
    constexpr std::size_t pose_size = sizeof(dVector3) + sizeof(dMatrix3);
    for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) {
      const dGeomID geom = dSpaceGetGeom(space, i);
      lines_.push_back(linesOf(geom, malloc_usable_size(geom)));
      lines_.push_back(linesOf(dGeomGetPosition(geom), pose_size));
    }
  }

  // Milliseconds to read a word of each line on so many threads, each with a part of its own;
  // lines are asked for `ahead` objects before they are read, if that is not 0.
  double read(int threads, std::size_t ahead) const {
    std::uint64_t all = 0;
    const Stopwatch clock;
#pragma omp parallel num_threads(threads) reduction(+ : all)
    {
      const std::size_t team = static_cast<std::size_t>(omp_get_num_threads());
      const std::size_t thread = static_cast<std::size_t>(omp_get_thread_num());
      all += readPart(lines_.size() * thread / team, lines_.size() * (thread + 1) / team, ahead);
    }
    const double ms = clock.milliseconds();
    sink_ = all;
    return ms;
  }

 private:
  std::uint64_t readPart(std::size_t begin, std::size_t end, std::size_t ahead) const {
    std::uint64_t sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (ahead && i + ahead < end) {
        const Lines& next = lines_[i + ahead];
        for (int line = 0; line < next.count; ++line)
          __builtin_prefetch(next.begin + line * line_bytes);
      }
      for (int line = 0; line < lines_[i].count; ++line)
        sum += *reinterpret_cast<const std::uint64_t*>(lines_[i].begin + line * line_bytes);
    }
    return sum;
  }

  std::vector<Lines> lines_;
  mutable volatile std::uint64_t sink_ = 0;
};

struct Times {
  std::vector<double> update, plain, prefetched;
};

Times measure(MovingCubes& cubes, const Wishes& wishes, int threads) {
  constexpr int first_frames = 3;  // not timed
  constexpr std::size_t ahead = 32;
  constexpr double reach = 0.01;
  dParallelSAPSpaceSetNumThreads(cubes.space(), threads);
  const Reader reader(cubes.space());
  const auto move = [&] {
    for (std::size_t i = 0; i < cubes.size(); ++i) cubes.move(i, reach);
  };
  Times times;
  double spent = 0;
  for (int frame = 0; frame < first_frames + 3 || spent < 1000 * wishes.seconds; ++frame) {
    move();
    std::size_t pairs;
    spent += timeCollide(cubes.space(), pairs);
    dParallelSAPStats stats;
    dParallelSAPSpaceGetStats(cubes.space(), &stats);
    if (stats.moved != cubes.size()) throw std::runtime_error("not all moved");
    move();
    const double plain = reader.read(threads, 0);
    move();
    const double prefetched = reader.read(threads, ahead);
    spent += plain + prefetched;
    if (frame < first_frames) continue;
    times.update.push_back(stats.update_ms);
    times.plain.push_back(plain);
    times.prefetched.push_back(prefetched);
  }
  return times;
}

// Adds the geoms once more, in an order that is not that of their memory.
void scatter(dSpaceID space) {
  std::vector<dGeomID> geoms;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i) geoms.push_back(dSpaceGetGeom(space, i));
  for (const dGeomID geom : geoms) dSpaceRemove(space, geom);
  sap_test::Random random(5);
  for (std::size_t i = geoms.size(); i > 1; --i) std::swap(geoms[i - 1], geoms[random.below(i)]);
  for (const dGeomID geom : geoms) dSpaceAdd(space, geom);
}

void run(const Wishes& wishes) {
  Csv csv(wishes.csv);
  std::printf("%9s %7s %11s %11s %16s %6s\n", "geoms", "threads", "update ms", "reading ms",
              "prefetching ms", "ratio");
  for (const std::size_t n : wishes.sizes) {
    MovingCubes cubes(dParallelSAPSpaceCreate(nullptr));
    dParallelSAPSpaceSetBackend(cubes.space(), dParallelSAPBackendCPU);
    for (const sap_test::Box& box : sap_test::denseCube(n, 1)) cubes.add(box, wishes.bodies);
    if (wishes.scattered) scatter(cubes.space());
    for (const int threads : wishes.threads) {
      const Times times = measure(cubes, wishes, threads);
      const double update = median(times.update);
      const double plain = median(times.plain), prefetched = median(times.prefetched);
      const double ratio = update / std::min(plain, prefetched);
      std::printf("%9zu %7d %11.4f %11.4f %16.4f %6.2f\n", n, threads, update, plain, prefetched,
                  ratio);
      std::fflush(stdout);
      csv.write(Row()
                    .add("n", n)
                    .add("bodies", wishes.bodies ? 1 : 0)
                    .add("scattered", wishes.scattered ? 1 : 0)
                    .add("threads", threads)
                    .add("samples", times.update.size())
                    .add("update_ms", update)
                    .add("reading_ms", plain)
                    .add("prefetching_ms", prefetched)
                    .add("ratio", ratio)
                    .addMachine());
    }
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Wishes wishes;
  bench::Program program(
      "update-benchmark: AABBs brought up to date against reading the same cache lines");
  program.add("--sizes", wishes.sizes, "geoms");
  program.add("--threads", wishes.threads)->check(CLI::PositiveNumber);
  program.add("--bodies", wishes.bodies, "each geom on a body of its own");
  program.add("--scattered", wishes.scattered, "geoms lie in no order in memory");
  program.add("--seconds", wishes.seconds, "of frames, a cell");
  program.add(wishes.csv);
  return program.run(argc, argv, [&] { bench::run(wishes); });
}
