// The environment variables that stand for settings.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/ode_errors.h"
#include "support/recorder.h"
#include "support/scenes.h"
#include "support/variable.h"

using namespace sap_test;

TEST_CASE("The environment sets the defaults of new spaces only", "[environment]") {
  const BareEnvironment bare;
  const Space before;
  const Variable backend("ODE_PARALLEL_SAP_BACKEND", "cpu");
  const Variable threads("ODE_PARALLEL_SAP_THREADS", "3");
  const Variable devices("ODE_PARALLEL_SAP_DEVICES", "2");
  const Variable skip_static("ODE_PARALLEL_SAP_SKIP_STATIC", "1");
  const Variable skip_asleep("ODE_PARALLEL_SAP_SKIP_ASLEEP", "1");
  const Variable cull_planes("ODE_PARALLEL_SAP_CULL_PLANES", "1");
  const Variable tolerance("ODE_PARALLEL_SAP_TOLERANCE", "25e-2");
  const Messages messages;
  for (const auto& [name, value] : {std::make_pair("sweep", int(dParallelSAPMethodSweep)),
                                    {"brute-force", int(dParallelSAPMethodBruteForce)},
                                    {"axis-lists", int(dParallelSAPMethodAxisLists)},
                                    {"auto", int(dParallelSAPMethodAuto)}}) {
    const Variable method("ODE_PARALLEL_SAP_METHOD", name);
    const Space space;
    CHECK(dParallelSAPSpaceGetMethod(space) == value);
    CHECK(dParallelSAPSpaceGetBackend(space) == dParallelSAPBackendCPU);
    CHECK(dParallelSAPSpaceGetNumThreads(space) == 3);
    CHECK(dParallelSAPSpaceGetNumDevices(space) == 2);
    CHECK(dParallelSAPSpaceGetSkipStatic(space) == 1);
    CHECK(dParallelSAPSpaceGetSkipAsleep(space) == 1);
    CHECK(dParallelSAPSpaceGetCullPlanes(space) == 1);
    CHECK(dParallelSAPSpaceGetTolerance(space) == dReal(0.25));
    // Not only the getter knows.
    World world(space);
    world.addBoxes(denseCube(300, 3));
    CHECK(collide(space).empty());
    // A program that sets something has the last word.
    dParallelSAPSpaceSetNumThreads(space, 5);
    CHECK(dParallelSAPSpaceGetNumThreads(space) == 5);
    dParallelSAPSpaceSetSkipStatic(space, 0);
    CHECK(!collide(space).empty());
  }
  for (const char* const nothing : {"0", ""}) {
    const Variable off("ODE_PARALLEL_SAP_SKIP_STATIC", nothing);
    const Space space;
    CHECK(dParallelSAPSpaceGetSkipStatic(space) == 0);
  }
  CHECK(messages.all().empty());
  CHECK(dParallelSAPSpaceGetBackend(before) == dParallelSAPBackendAuto);
  CHECK(dParallelSAPSpaceGetNumThreads(before) == 0);
}

TEST_CASE("Environment variables that make no sense are reported and ignored", "[environment]") {
  const BareEnvironment bare;
  const char* const nonsense[][2] = {{"ODE_PARALLEL_SAP_BACKEND", "gpu2000"},
                                     {"ODE_PARALLEL_SAP_METHOD", "Sweep!"},
                                     {"ODE_PARALLEL_SAP_METHOD", "1"},
                                     {"ODE_PARALLEL_SAP_THREADS", "many"},
                                     {"ODE_PARALLEL_SAP_THREADS", "-1"},
                                     {"ODE_PARALLEL_SAP_THREADS", "2x"},
                                     {"ODE_PARALLEL_SAP_DEVICES", "1.5"},
                                     {"ODE_PARALLEL_SAP_SIMD", "mmx"},
                                     {"ODE_PARALLEL_SAP_SIMD", "SSE2"},
                                     {"ODE_PARALLEL_SAP_STATS", "yes"},
                                     {"ODE_PARALLEL_SAP_STATS", "2"},
                                     {"ODE_PARALLEL_SAP_THREADS", "99999999999999999999999"},
                                     {"ODE_PARALLEL_SAP_SKIP_STATIC", "yes"},
                                     {"ODE_PARALLEL_SAP_SKIP_ASLEEP", " 1"},
                                     {"ODE_PARALLEL_SAP_CULL_PLANES", "-1"},
                                     {"ODE_PARALLEL_SAP_CULL_PLANES", "01"},
                                     {"ODE_PARALLEL_SAP_NOTIFIED", "yes"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "-0.1"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "0.1m"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "nan"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "inf"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "1e999"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "0,1"},
                                     {"ODE_PARALLEL_SAP_TOLERANCE", "0.1 "}};
  for (const auto& [name, value] : nonsense) {
    const Variable variable(name, value);
    const Messages messages;
    const Space space;
    INFO(name << "=" << value);
    REQUIRE(messages.all().size() == 1);
    CHECK(messages.all()[0].find(name + std::string("=") + value) == 0);
    CHECK(dParallelSAPSpaceGetBackend(space) == dParallelSAPBackendAuto);
    CHECK(dParallelSAPSpaceGetMethod(space) == dParallelSAPMethodAuto);
    CHECK(dParallelSAPSpaceGetNumThreads(space) == 0);
    CHECK(dParallelSAPSpaceGetNumDevices(space) == 0);
    CHECK(dParallelSAPSpaceGetSkipStatic(space) == 0);
    CHECK(dParallelSAPSpaceGetSkipAsleep(space) == 0);
    CHECK(dParallelSAPSpaceGetCullPlanes(space) == 0);
    CHECK(dParallelSAPSpaceGetNotified(space) == 0);
    CHECK(dParallelSAPSpaceGetTolerance(space) == 0);
  }
}

TEST_CASE("What is not to be had is reported when the environment asks for it", "[environment]") {
  const BareEnvironment bare;
  const Space asking;
  const bool cuda = dParallelSAPSpaceSetBackend(asking, dParallelSAPBackendCUDA);
  {
    const Variable variable("ODE_PARALLEL_SAP_BACKEND", "cuda");
    const Messages messages;
    const Space space;
    CHECK(messages.all().empty() == cuda);
    CHECK(dParallelSAPSpaceGetBackend(space) ==
          (cuda ? dParallelSAPBackendCUDA : dParallelSAPBackendAuto));
  }
}

namespace {

// Whether this processor has an instruction set, asked of the compiler.
bool processorHas(const std::string& set) {
  if (set == "portable") return true;
#if defined(__x86_64__)
  if (set == "sse2") return true;
  if (set == "avx2") return __builtin_cpu_supports("avx2");
  if (set == "avx512")
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#elif defined(__aarch64__)
  if (set == "neon") return true;
#endif
  return false;
}

// What a space that is created, collided and destroyed says of itself.
std::string instructionSetInUse() {
  const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
  const Messages messages;
  {
    const Space space;
    World world(space);
    world.addBoxes(denseCube(200, 1));
    collide(space);
  }
  REQUIRE(!messages.all().empty());  // what would have saved time may follow
  const std::string& text = messages.all()[0];
  const std::size_t begin = text.find('(') + 1;
  return text.substr(begin, text.find(')') - begin);
}

}  // namespace

TEST_CASE("ODE_PARALLEL_SAP_SIMD forces an instruction set that the processor has",
          "[environment]") {
  const BareEnvironment bare;
  const std::string best = instructionSetInUse();
  CHECK(processorHas(best));
  for (const std::string set : {"portable", "sse2", "avx2", "avx512", "neon"}) {
    INFO(set);
    const Variable variable("ODE_PARALLEL_SAP_SIMD", set.c_str());
    if (processorHas(set)) {
      CHECK(instructionSetInUse() == set);
      continue;
    }
    {
      const Messages messages;
      const Space space;
      REQUIRE(messages.all().size() == 1);
      CHECK(messages.all()[0] ==
            "ODE_PARALLEL_SAP_SIMD=" + set + " is not to be had here and is ignored");
    }
    const Variable no_longer("ODE_PARALLEL_SAP_SIMD", nullptr);
    CHECK(instructionSetInUse() == best);
  }
}

TEST_CASE("ODE_PARALLEL_SAP_STATS=1 tells where the time went when a space ends", "[environment]") {
  const BareEnvironment bare;
  const auto ignore = [](void*, dGeomID, dGeomID, const dContactGeom*, int) {};
  const dParallelSAPContactCallbacks callbacks = {ignore, nullptr, nullptr, nullptr};
  dParallelSAPStats of_pairs, of_contacts;
  const auto messagesOf = [&](const char* value, std::size_t n) {
    const Variable variable("ODE_PARALLEL_SAP_STATS", value);
    const Messages messages;
    {
      const Space space;
      World world(space);
      world.addBoxes(denseCube(n, 1));
      collide(space);
      of_pairs = statsOf(space);
      dParallelSAPSpaceCollideContacts(space, nullptr, 4, &callbacks);
      of_contacts = statsOf(space);
      REQUIRE(messages.all().empty());
    }
    return messages.all();
  };
  for (const std::size_t n : {100, 1500}) {
    const std::vector<std::string> said = messagesOf("1", n);
    REQUIRE(!said.empty());  // what would have saved time may follow
    INFO(said[0]);
    const auto half = [](unsigned long long sum) { return static_cast<double>(sum) / 2; };
    int frames = 0, geoms = 0;
    double pairs = 0, contacts = 0, total = 0, update = 0, synchronise = 0, extract = 0, filter = 0,
           narrow = 0, report = 0;
    REQUIRE(std::sscanf(
                said[0].c_str(),
                "parallel SAP space %*p: %d frames (%*[a-z0-9]), a frame: %d geoms, %lf pairs, %lf "
                "contacts, %lf ms (update %lf, synchronise %lf, extract %lf, filter %lf, "
                "narrow %lf, report %lf)",
                &frames, &geoms, &pairs, &contacts, &total, &update, &synchronise, &extract,
                &filter, &narrow, &report) == 11);
    CHECK(frames == 2);
    CHECK(geoms == static_cast<int>(n));
    CHECK(std::fabs(pairs - half(of_pairs.pairs + of_contacts.pairs)) <= 0.5);
    CHECK(of_contacts.contacts > 0);
    CHECK(std::fabs(contacts - half(of_contacts.contacts)) <= 0.5);
    constexpr double digit = 0.00051;
    using Time = double dParallelSAPStats::*;
    const std::pair<double, Time> times[] = {{total, &dParallelSAPStats::total_ms},
                                             {update, &dParallelSAPStats::update_ms},
                                             {synchronise, &dParallelSAPStats::synchronise_ms},
                                             {extract, &dParallelSAPStats::extract_ms},
                                             {filter, &dParallelSAPStats::filter_ms},
                                             {narrow, &dParallelSAPStats::narrow_ms},
                                             {report, &dParallelSAPStats::report_ms}};
    for (const auto& [told, time] : times)
      CHECK(std::fabs(told - (of_pairs.*time + of_contacts.*time) / 2) <= digit);
    CHECK(narrow > 0);
  }
  CHECK(messagesOf("0", 100).empty());
  CHECK(messagesOf(nullptr, 100).empty());
}

TEST_CASE("ODE_PARALLEL_SAP_STATS=1 tells what queries and rays took in a space without frames",
          "[environment]") {
  const BareEnvironment bare;
  const Variable variable("ODE_PARALLEL_SAP_STATS", "1");
  const Messages messages;
  {
    const Space space;
    World world(space);
    world.addBoxes(denseCube(300, 1));
    const dGeomID probe = dCreateSphere(nullptr, 5);
    for (int i = 0; i < 7; ++i) collide2(space, probe);
    dGeomDestroy(probe);
    const dParallelSAPRay rays[30] = {};
    dParallelSAPRayHit hits[30];
    dParallelSAPSpaceRays(space, rays, 30, 0, hits);
  }
  REQUIRE(messages.all().size() == 1);
  INFO(messages.all()[0]);
  int queries = 0, rays = 0;
  double queries_ms = 0, rays_ms = 0;
  REQUIRE(
      std::sscanf(messages.all()[0].c_str(),
                  "parallel SAP space %*p: dSpaceCollide2 of %d geoms with their callbacks took "
                  "%lf ms, %d rays took %lf ms",
                  &queries, &queries_ms, &rays, &rays_ms) == 4);
  CHECK(queries == 7);
  CHECK(rays == 30);
  CHECK(queries_ms > 0);
}
