// The files of traces: whose they are, when they end, and what becomes of them where they cannot be
// written.
#include <ode_parallel_sap/parallel_sap_space.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "player.h"
#include "support/catch.hpp"
#include "support/ode_errors.h"
#include "support/recorder.h"
#include "support/trace_files.h"
#include "support/variable.h"
#include "trace_reader.h"

using namespace sap_test;
namespace fs = std::filesystem;

TEST_CASE("A trace ends when it is told to, and another one begins with all geoms", "[trace]") {
  const Folder folder;
  const dSpaceID space = boxes(20);
  REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
  REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "a").c_str(), 2) == 1);
  REQUIRE(dParallelSAPSpaceGetTrace(space) == 2);
  for (int i = 0; i < 4; ++i) collide(space);
  REQUIRE(dParallelSAPSpaceSetTrace(space, (folder / "b").c_str(), 1) == 1);
  collide(space);
  REQUIRE(dParallelSAPSpaceSetTrace(space, nullptr, 0) == 1);
  REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
  collide(space);
  REQUIRE(framesIn(folder / "a") == 2);
  REQUIRE(framesIn(folder / "b") == 1);
  REQUIRE(trace::readRecording(folder / "b").frames[0].geoms.size() == 20);
  dSpaceDestroy(space);
}

TEST_CASE("Where a trace cannot be written, one message says so and the program goes on",
          "[trace]") {
  const Folder folder;
  const dSpaceID space = boxes(20);
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
    const dSpaceID other = boxes(20);
    for (int i = 0; i < 3; ++i) REQUIRE(collide(other).size() == 19);
    REQUIRE(dParallelSAPSpaceGetTrace(other) == 0);
    REQUIRE(messages.all().size() == 1);
    REQUIRE(messages.all()[0].find("No space left on device") != std::string::npos);
    dSpaceDestroy(other);
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
  dSpaceDestroy(space);
}

TEST_CASE("The child of a fork writes no trace, its parent's or the environment's", "[trace]") {
  for (const bool by_variable : {false, true}) {
    const Folder folder;
    const std::string path = folder / "trace";
    const Variable variable("ODE_PARALLEL_SAP_TRACE", by_variable ? path.c_str() : nullptr);
    const dSpaceID space = boxes(20);
    if (!by_variable) {
      dParallelSAPSpaceSetTrace(space, path.c_str(), 1);
      collide(space);
    }
    const pid_t child = fork();
    if (child == 0) {
      const std::size_t own = collide(boxes(20)).size();
      _exit(own == 19 && collide(space).size() == 19 ? 0 : 1);
    }
    int status = -1;
    REQUIRE(waitpid(child, &status, 0) == child);
    REQUIRE(status == 0);
    REQUIRE(folder.files().size() == (by_variable ? 0 : 1));
    collide(space);
    REQUIRE(folder.files().size() == 1);
    REQUIRE(framesIn(folder.files()[0]) == (by_variable ? 1 : 2));
    dSpaceDestroy(space);
  }
}

TEST_CASE("Who replays a trace does not write over it", "[trace]") {
  const Folder folder;
  const Variable variable("ODE_PARALLEL_SAP_TRACE", (folder / "trace").c_str());
  for (const bool replaying : {false, true}) {
    const dSpaceID space = boxes(20);
    collide(space);
    dSpaceDestroy(space);
    REQUIRE(folder.files().size() == 1);
    if (!replaying) REQUIRE(trace::readRecording(folder.files()[0]).frames.size() == 1);
  }
}

TEST_CASE("The environment has a file for each space that collides", "[trace]") {
  const Folder folder;
  {
    const Variable variable("ODE_PARALLEL_SAP_TRACE", (folder / "t%p:2").c_str());
    const dSpaceID first = boxes(3), silent = boxes(4), second = boxes(5);
    for (int i = 0; i < 3; ++i) collide(second);
    for (int i = 0; i < 5; ++i) collide(first);
    for (const dSpaceID space : {first, silent, second}) dSpaceDestroy(space);
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
    const dSpaceID space = boxes(2);
    REQUIRE(dParallelSAPSpaceGetTrace(space) == 0);
    dSpaceDestroy(space);
  }
  REQUIRE(messages.all().size() == 2);
  for (const char* right : {"trace:x:7", "trace:7", "a:b"}) {
    const Variable variable("ODE_PARALLEL_SAP_TRACE", right);
    const dSpaceID space = boxes(2);
    REQUIRE(dParallelSAPSpaceGetTrace(space) == (right == std::string("a:b") ? 1 : 7));
    dSpaceDestroy(space);
  }
  REQUIRE(messages.all().size() == 2);
}
