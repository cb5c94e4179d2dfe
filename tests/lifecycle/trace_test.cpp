// What a trace tells of a program: the very pairs of its frames. Whose the files of traces are,
// when they end, and what becomes of them where they cannot be written.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "fuzz/driver.h"
#include "player.h"
#include "support/tests.h"
#include "support/variable.h"
#include "trace_reader.h"

using namespace sap_test;
namespace fs = std::filesystem;

namespace {

// A folder of the test's own, gone with it.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "trace-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path_)) names.push_back(entry.path().string());
    return names;
  }

 private:
  fs::path path_;
};

// A space of a row of boxes.
struct Row : Space {
  explicit Row(int count) {
    for (int i = 0; i < count; ++i)
      dGeomSetPosition(dCreateBox(*this, 1, 1, 1), real(0.75 * i), 0, 0);
  }
};

std::string contentsOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

// Pairs by the places of their geoms in the space, which are those of the order of the report.
Pairs pairsByPlace(dSpaceID space) {
  std::map<dGeomID, std::size_t> places;
  for (int i = 0; i < dSpaceGetNumGeoms(space); ++i)
    places[dSpaceGetGeom(space, i)] = places.size();
  Pairs pairs;
  std::vector<std::pair<dGeomID, dGeomID>> found;
  collide(space, [&](dGeomID a, dGeomID b) { found.emplace_back(a, b); });
  for (const auto& [a, b] : found) pairs.emplace_back(places.at(a), places.at(b));
  return pairs;
}

// A program without user classes that test or change by themselves, of which no trace tells.
class Program : private Decisions, public Driver {
 public:
  Program(std::uint64_t seed, std::size_t geoms)
      : Decisions(seed), Driver(*this, geoms, &configurations()[0], false) {
    changes_users_unasked_ = sweeps_ = false;
    dParallelSAPSpaceSetSweptBounds(space(), 0);  // with which boxes are not as geoms lie
    for (int i = 0; i < 4; ++i) populate();
  }

  // The next frame's pairs.
  Pairs frame() {
    for (std::size_t i = below(4); i > 0; --i) step(false);
    dParallelSAPSpaceSetTolerance(space(), 0);  // else a trace does not know the pairs
    dParallelSAPSpaceSetCullPlanes(space(), below(2) == 1);
    return pairsByPlace(space());
  }
};

// Runs a program and has it traced; the pairs are those of the run.
std::vector<Pairs> runTraced(std::uint64_t seed, std::size_t geoms, int frames, int every,
                             const std::string& path) {
  Program program(seed, geoms);
  REQUIRE(dParallelSAPSpaceSetTrace(program.space(), path.c_str(), every) == 1);
  std::vector<Pairs> pairs;
  for (int frame = 0; frame < frames; ++frame) {
    Pairs found = program.frame();
    if (frame % every == 0) pairs.push_back(std::move(found));
  }
  return pairs;
}

// What a replay shows: the pairs of each frame.
void checkReplay(const std::string& path, const std::vector<Pairs>& expected, int every) {
  const Messages messages;  // of NaN bounds
  const trace::Recording recording = trace::readRecording(path);
  REQUIRE(recording.frames.size() == expected.size());
  REQUIRE(recording.by_bounds.empty());  // it is the same ODE
  REQUIRE(recording.header.every == static_cast<std::uint32_t>(every));
  const Space space;
  {
    trace::Player player(recording, space);
    for (int turn = 0; turn < 2; ++turn)
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const trace::Frame& frame = player.advance();
        trace::setAsTraced(space, frame);
        INFO("turn " << turn << ", frame " << i);
        CHECK(player.otherBounds().empty());
        REQUIRE(frame.collide == 1 + i * static_cast<std::size_t>(every));
        REQUIRE(difference(pairsByPlace(space), expected[i]) == "");
        REQUIRE(frame.pairs.has_value());
        REQUIRE(frame.pairs->count == expected[i].size());
        REQUIRE((trace::collide(space) == *frame.pairs));
      }
  }
  REQUIRE(dSpaceGetNumGeoms(space) == 0);
}

// The recording of a row of boxes.
template <class Run>
trace::Recording recordingOf(int boxes_in_row, Run run) {
  const Folder folder;
  {
    const Row space(boxes_in_row);
    dParallelSAPSpaceSetTrace(space, (folder / "trace").c_str(), 1);
    run(space);
  }
  return trace::readRecording(folder / "trace");
}

// The file of a small trace of few frames.
std::string smallTrace() {
  const Folder folder;
  runTraced(seedOr(5), 4, 4, 1, folder / "trace");
  return contentsOf(folder / "trace");
}

// Reads and replays what is in a file: true, or false where it is refused.
bool isTaken(const std::string& contents) {
  try {
    std::istringstream file(contents);
    const trace::Recording recording = trace::readRecording(file, "the trace");
    const Space space;
    trace::Player player(recording, space);
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
      trace::setAsTraced(space, player.advance());
      trace::collide(space);
    }
    return true;
  } catch (const trace::BadTrace& refused) {
    REQUIRE(std::string(refused.what()).find("the trace: ") == 0);
    return false;
  }
}

std::uint64_t wordAt(const std::string& bytes, std::size_t at) {
  std::uint64_t word = 0;
  for (std::size_t i = 8; i-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

// Where chunks begin and the file ends.
std::vector<std::size_t> chunksOf(const std::string& bytes) {
  std::vector<std::size_t> begins;
  for (std::size_t at = 8; at < bytes.size(); at += 24 + wordAt(bytes, at + 8))
    begins.push_back(at);
  begins.push_back(bytes.size());
  return begins;
}

void setChecksum(std::string& bytes, std::size_t chunk) {
  namespace format = trace::format;
  const std::uint64_t size = wordAt(bytes, chunk + 8);
  std::uint64_t checksum = format::addToChecksum(format::checksum_begin, wordAt(bytes, chunk));
  checksum = format::addToChecksum(checksum, size);
  for (std::size_t i = 0; i < size; i += 8)
    checksum = format::addToChecksum(checksum, wordAt(bytes, chunk + 24 + i));
  for (std::size_t i = 0; i < 8; ++i) bytes[chunk + 16 + i] = static_cast<char>(checksum >> 8 * i);
}

}  // namespace

TEST_CASE("A replay has the pairs of every frame of the program, in their order", "[trace]") {
  const Folder folder;
  std::size_t all = 0;
  for (const std::size_t geoms : {60, 400})
    for (int run = 0; run < scaled(geoms == 60 ? 30 : 9); ++run)
      for (const int every : {1, 3}) {
        const std::uint64_t seed = seedOr(geoms, run);
        INFO("geoms " << geoms << ", every " << every << ", ODE_PARALLEL_SAP_TEST_SEED=" << seed);
        const std::vector<Pairs> pairs = runTraced(seed, geoms, 60, every, folder / "trace");
        for (const Pairs& frame : pairs) all += frame.size();
        checkReplay(folder / "trace", pairs, every);
        // A trace changes none of them.
        Program untraced(seed, geoms);
        for (std::size_t frame = 0; frame < 60; ++frame) {
          const Pairs found = untraced.frame();
          if (frame % every == 0) REQUIRE(difference(found, pairs[frame / every]) == "");
        }
      }
  CHECK(all > static_cast<std::size_t>(scaled(100000)));
}

TEST_CASE("Frames in which nothing changes are a few bytes in a trace", "[trace]") {
  const Folder folder;
  const Row space(500);
  dParallelSAPSpaceSetTrace(space, (folder / "trace").c_str(), 1);
  collide(space);
  const auto first = fs::file_size(folder / "trace");
  REQUIRE(first > 500 * 100);
  for (int i = 0; i < 10; ++i) collide(space);
  REQUIRE(fs::file_size(folder / "trace") - first < 10 * 150);
  dGeomSetPosition(dSpaceGetGeom(space, 7), 0, 0, 0);
  collide(space);
  REQUIRE(fs::file_size(folder / "trace") - first < 10 * 150 + 400);
  REQUIRE(trace::readRecording(folder / "trace").frames.size() == 12);
}

TEST_CASE(
    "A trace counts pairs in blocks, knows none of contacts, and has no collides in callbacks",
    "[trace]") {
  const trace::Recording recording = recordingOf(300, [](dSpaceID space) {
    collide(space, [&](dGeomID, dGeomID) { REQUIRE(collide(space).size() == 299); });
    const auto ignore = [](void*, const dParallelSAPPair*, size_t, size_t) {};
    dParallelSAPSpaceCollidePairs(space, nullptr, 0, ignore);
    dParallelSAPSpaceCollidePairs(space, nullptr, dParallelSAPPairsConcurrent, nullptr);
    dParallelSAPContactCallbacks callbacks = {};
    callbacks.contacts = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
    dParallelSAPSpaceCollideContacts(space, nullptr, 1, &callbacks);
    REQUIRE(collideUntil(space, 3).size() == 3);
    dParallelSAPSpaceSetTolerance(space, 1);
    collide(space);
  });
  REQUIRE(recording.frames.size() == 6);
  REQUIRE(recording.frames[0].pairs->count == 299);
  REQUIRE((recording.frames[1].pairs == recording.frames[0].pairs));
  REQUIRE((recording.frames[2].pairs == recording.frames[0].pairs));
  for (const int unknown : {3, 5}) REQUIRE(!recording.frames[unknown].pairs.has_value());
  REQUIRE((recording.frames[4].pairs == recording.frames[0].pairs));  // an exception ended it
  REQUIRE(recording.frames[4].tolerance == 0);
  REQUIRE(recording.frames[5].tolerance == 1);
}

TEST_CASE("A geom to which this ODE gives another bounding box is shown by the one written",
          "[trace]") {
  const Folder folder;
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  for (const int x : {0, 10, 20}) dGeomSetPosition(dCreateBox(space, 1, 1, 1), dReal(x), 0, 0);
  dParallelSAPSpaceSetTrace(space, (folder / "trace").c_str(), 1);
  REQUIRE(collide(space).empty());
  dSpaceDestroy(space);
  std::string contents = contentsOf(folder / "trace");
  // The greatest x of the first geom, up to which the second one lies.
  const std::size_t frame = chunksOf(contents)[1];
  const std::size_t at = frame + 24 + 48 + 40 + (4 + 12 + 1) * sizeof(dReal);
  const dReal greater = 15;
  std::memcpy(&contents[at], &greater, sizeof greater);
  setChecksum(contents, frame);
  std::istringstream file(contents);
  const trace::Recording recording = trace::readRecording(file, "the trace");
  REQUIRE((recording.by_bounds == std::set<std::uint32_t>{1}));
  const Space replayed;
  trace::Player player(recording, replayed);
  player.advance();
  REQUIRE((pairsByPlace(replayed) == Pairs{{0, 1}}));
}

TEST_CASE("A trace that ends within a chunk, or in which any byte was changed, is refused",
          "[trace]") {
  const std::string whole = smallTrace();
  const std::vector<std::size_t> chunks = chunksOf(whole);
  REQUIRE(chunks.size() == 1 + 4 * 2 + 1);
  Random random(seedOr(6));
  for (std::size_t at = 0; at < whole.size(); ++at) {
    INFO("byte " << at);
    const bool ends_a_chunk = std::find(chunks.begin() + 2, chunks.end(), at) != chunks.end();
    REQUIRE(isTaken(whole.substr(0, at)) == ends_a_chunk);
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ (1 + random.below(255)));
    REQUIRE(!isTaken(changed));
  }
}

TEST_CASE("A trace that lies, with checksums that are right, is refused or replayed", "[trace]") {
  const std::string whole = smallTrace();
  const std::vector<std::size_t> chunks = chunksOf(whole);
  Random random(seedOr(7));
  const Messages messages;  // of NaN bounds
  int taken = 0, refused = 0;
  for (int run = 0; run < scaled(20000); ++run) {
    std::string changed = whole;
    const std::size_t chunk = random.below(chunks.size() - 1);
    const std::size_t size = wordAt(whole, chunks[chunk] + 8);
    for (std::size_t bytes = 1 + random.below(3); bytes > 0; --bytes) {
      // Mostly in the counts and numbers at the front.
      const std::size_t at =
          random.below(random.chance(0.5) ? std::min<std::size_t>(size, 64) : size);
      changed[chunks[chunk] + 24 + at] =
          static_cast<char>(random.chance(0.5) ? random.below(256) : random.below(16));
    }
    setChecksum(changed, chunks[chunk]);
    INFO("run " << run << ", ODE_PARALLEL_SAP_TEST_SEED=" << seedOr(7));
    ++(isTaken(changed) ? taken : refused);
  }
  REQUIRE(taken > 0);
  REQUIRE(refused > 0);
}

TEST_CASE("A trace ends when it is told to, and another one begins with all geoms", "[trace]") {
  const Folder folder;
  const Row space(20);
  REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
  REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "a").c_str(), 2) == 1);
  REQUIRE(dParallelSAPSpaceGetTrace(space) == 2);
  for (int i = 0; i < 4; ++i) collide(space);
  REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "b").c_str(), 1) == 1);
  collide(space);
  REQUIRE(dParallelSAPSpaceSetTrace(space, nullptr, 0) == 1);
  REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
  collide(space);
  REQUIRE(trace::readRecording(folder / "a").frames.size() == 2);
  REQUIRE(trace::readRecording(folder / "b").frames.size() == 1);
  REQUIRE(trace::readRecording(folder / "b").frames[0].geoms.size() == 20);
}

TEST_CASE("Where a trace cannot be written, one message says so and the program goes on",
          "[trace]") {
  const Folder folder;
  const Row space(20);
  REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "before").c_str(), 1) == 1);
  {
    const Messages messages;
    REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "none/trace").c_str(), 1) == 0);
    REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
    REQUIRE(collide(space).size() == 19);
    REQUIRE(messages.all().size() == 1);
    REQUIRE(messages.all()[0].find("none/trace cannot be written: No such file") !=
            std::string::npos);
  }
  if (fs::exists("/dev/full")) {
    const Messages messages;
    const Variable variable("ODE_PARALLEL_SAP_TRACE", "/dev/full");
    const Row other(20);
    for (int i = 0; i < 3; ++i) REQUIRE(collide(other).size() == 19);
    REQUIRE(dParallelSAPSpaceGetTrace(other) == 0);
    REQUIRE(messages.all().size() == 1);
    REQUIRE(messages.all()[0].find("No space left on device") != std::string::npos);
  }
  // A file that may not grow ends with the last whole frame.
  {
    const Messages messages;
    const auto before = std::signal(SIGXFSZ, SIG_IGN);
    rlimit usual;
    getrlimit(RLIMIT_FSIZE, &usual);
    const rlimit small = {20000, usual.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "full").c_str(), 1) == 1);
    for (int i = 0; i < 100; ++i) {
      dGeomSetPosition(dSpaceGetGeom(space, 0), -i, 0, 0);
      collide(space);
    }
    setrlimit(RLIMIT_FSIZE, &usual);
    std::signal(SIGXFSZ, before);
    REQUIRE(messages.all().size() == 1);
    REQUIRE(messages.all()[0].find("full ends here: File too large") != std::string::npos);
  }
  const std::size_t frames = trace::readRecording(folder / "full").frames.size();
  REQUIRE(frames > 0);
  REQUIRE(frames < 100);
}

TEST_CASE("The child of a fork writes no trace, its parent's or the environment's", "[trace]") {
  for (const bool by_variable : {false, true}) {
    const Folder folder;
    const std::string path = folder / "trace";
    const Variable variable("ODE_PARALLEL_SAP_TRACE", by_variable ? path.c_str() : nullptr);
    const Row space(20);
    if (!by_variable) {
      dParallelSAPSpaceSetTrace(space, path.c_str(), 1);
      collide(space);
    }
    const pid_t child = fork();
    if (child == 0) {
      const std::size_t own = collide(Row(20)).size();
      _exit(own == 19 && collide(space).size() == 19 ? 0 : 1);
    }
    int status = -1;
    REQUIRE(waitpid(child, &status, 0) == child);
    REQUIRE(status == 0);
    REQUIRE(folder.files().size() == (by_variable ? 0 : 1));
    collide(space);
    REQUIRE(folder.files().size() == 1);
    REQUIRE(trace::readRecording(folder.files()[0]).frames.size() == (by_variable ? 1 : 2));
  }
}

TEST_CASE("Who replays a trace does not write over it", "[trace]") {
  const Folder folder;
  const Variable variable("ODE_PARALLEL_SAP_TRACE", (folder / "trace").c_str());
  for (const bool replaying : {false, true}) {
    collide(Row(20));
    REQUIRE(folder.files().size() == 1);
    if (!replaying) REQUIRE(trace::readRecording(folder.files()[0]).frames.size() == 1);
  }
}

TEST_CASE("The environment has a file for each space that collides", "[trace]") {
  const Folder folder;
  {
    const Variable variable("ODE_PARALLEL_SAP_TRACE", (folder / "t%p:2").c_str());
    const Row first(3), silent(4), second(5);
    for (int i = 0; i < 3; ++i) collide(second);
    for (int i = 0; i < 5; ++i) collide(first);
  }
  std::vector<std::size_t> geoms;
  std::vector<std::size_t> frames;
  for (const auto& entry : fs::directory_iterator(folder / "")) {
    REQUIRE(entry.path().filename().string().find("t" + std::to_string(getpid())) == 0);
    const trace::Recording recording = trace::readRecording(entry.path().string());
    geoms.push_back(recording.frames[0].geoms.size());
    frames.push_back(recording.frames.size());
  }
  REQUIRE(asSet({{geoms.at(0), frames.at(0)}, {geoms.at(1), frames.at(1)}}) ==
          asSet({{3, 3}, {5, 2}}));
  REQUIRE(geoms.size() == 2);

  const Messages messages;
  for (const char* wrong : {"trace:0", ":3"}) {
    const Variable variable("ODE_PARALLEL_SAP_TRACE", wrong);
    const Row space(2);
    REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
  }
  REQUIRE(messages.all().size() == 2);
  for (const char* right : {"trace:x:7", "trace:7", "a:b"}) {
    const Variable variable("ODE_PARALLEL_SAP_TRACE", right);
    const Row space(2);
    REQUIRE(dParallelSAPSpaceGetTrace(space) == (right == std::string("a:b") ? 1 : 7));
  }
  REQUIRE(messages.all().size() == 2);
}
