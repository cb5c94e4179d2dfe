// The environment variables that stand for settings.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>

#include "support/contact_scene.h"
#include "support/overlap_oracle.h"
#include "support/tests.h"
#include "support/variable.h"

using namespace sap_test;

namespace {

// A setting's variable, what values make of the setting, and values that make no sense.
struct Setting {
  std::string variable;
  std::function<double(dSpaceID)> get;
  std::vector<std::pair<const char*, double>> values;
  std::vector<const char*> nonsense;
};

const Setting kSettings[] = {
    {"BACKEND",
     dParallelSAPSpaceGetBackend,
     {{"cpu", dParallelSAPBackendCPU}, {"auto", dParallelSAPBackendAuto}},
     {"gpu2000"}},
    {"METHOD",
     dParallelSAPSpaceGetMethod,
     {{"sweep", dParallelSAPMethodSweep},
      {"brute-force", dParallelSAPMethodBruteForce},
      {"axis-lists", dParallelSAPMethodAxisLists},
      {"auto", dParallelSAPMethodAuto}},
     {"Sweep!", "1"}},
    {"THREADS",
     dParallelSAPSpaceGetNumThreads,
     {{"3", 3}, {"1000", 256}},
     {"many", "-1", "2x", "99999999999999999999999"}},
    {"DEVICES", dParallelSAPSpaceGetNumDevices, {{"2", 2}}, {"1.5"}},
    {"SKIP_STATIC", dParallelSAPSpaceGetSkipStatic, {{"1", 1}, {"0", 0}, {"", 0}}, {"yes"}},
    {"SKIP_ASLEEP", dParallelSAPSpaceGetSkipAsleep, {{"1", 1}, {"0", 0}}, {" 1"}},
    {"CULL_PLANES", dParallelSAPSpaceGetCullPlanes, {{"1", 1}, {"0", 0}}, {"-1", "01"}},
    {"NOTIFIED", dParallelSAPSpaceGetNotified, {{"1", 1}, {"0", 0}}, {"yes"}},
    {"TOLERANCE",
     dParallelSAPSpaceGetTolerance,
     {{"25e-2", 0.25}},
     {"-0.1", "0.1m", "nan", "inf", "1e999", "0,1", "0.1 "}},
    {"SIMD", nullptr, {}, {"mmx", "SSE2"}},
    {"STATS", nullptr, {}, {"yes", "2"}}};

// Whether a value is one of a few words.
bool isName(const std::string& value) {
  return value == "0" || value == "1" || value.find_first_of("0123456789") == std::string::npos;
}

}  // namespace

TEST_CASE("The environment sets the defaults of new spaces only", "[environment]") {
  const BareEnvironment bare;
  const Space before;
  const Messages messages;
  for (const Setting& setting : kSettings)
    for (const auto& [value, expected] : setting.values) {
      const Variable variable(("ODE_PARALLEL_SAP_" + setting.variable).c_str(), value);
      const Space space;
      INFO(setting.variable << "=" << value);
      CHECK(setting.get(space) == expected);
      CHECK(setting.get(before) == 0);
    }
  CHECK(messages.all().empty());

  // Not only the getter knows, and a program that sets something has the last word.
  const Variable variable("ODE_PARALLEL_SAP_SKIP_STATIC", "1");
  const Space space;
  World world(space, denseCube(300, 3));
  CHECK(collide(space).empty());
  dParallelSAPSpaceSetSkipStatic(space, 0);
  CHECK(!collide(space).empty());
}

TEST_CASE("Environment variables that make no sense are reported and ignored", "[environment]") {
  const BareEnvironment bare;
  for (const Setting& setting : kSettings)
    for (const std::string value : setting.nonsense) {
      const std::string name = "ODE_PARALLEL_SAP_" + setting.variable;
      const Variable variable(name.c_str(), value.c_str());
      const Messages messages;
      const Space space;
      INFO(name << "=" << value);
      const Space other;  // which says it no more
      REQUIRE(messages.all().size() == 1);
      const std::string& said = messages.all()[0];
      CHECK(said.find(name + "=" + value) == 0);
      for (const auto& [allowed, expected] : setting.values)
        CHECK((!isName(allowed) || said.find(allowed) != std::string::npos));
      for (const Setting& any : kSettings) CHECK((!any.get || any.get(space) == 0));
    }
}

TEST_CASE("A variable that the library does not know is reported once, with those that it knows",
          "[environment]") {
  const BareEnvironment bare;
  const Space before;  // reports what the person who runs the tests has misspelt
  const Variable misspelt("ODE_PARALLEL_SAP_STAT", "1"), of_tests("ODE_PARALLEL_SAP_TEST_X", "1");
  const Variable empty("ODE_PARALLEL_SAP_", ""), other("ODE_PARALLEL_SAPLING", "1");
  const Messages messages;
  const Space space, later;
  REQUIRE(messages.all().size() == 2);
  for (const std::string name : {"ODE_PARALLEL_SAP_STAT ", "ODE_PARALLEL_SAP_ "}) {
    const auto& all = messages.all();
    CHECK(std::count_if(all.begin(), all.end(), [&](const std::string& said) {
            return said.find(name + "is no variable of this library and is ignored") == 0;
          }) == 1);
  }
  for (const Setting& setting : kSettings)
    CHECK(messages.all()[0].find(setting.variable) != std::string::npos);
}

TEST_CASE("What is not to be had is reported when the environment asks for it", "[environment]") {
  const BareEnvironment bare;
  const Space asking;
  const bool cuda = dParallelSAPSpaceSetBackend(asking, dParallelSAPBackendCUDA);
  const Variable variable("ODE_PARALLEL_SAP_BACKEND", "cuda");
  const Messages messages;
  const Space space;
  REQUIRE(messages.all().empty() == cuda);
  if (!cuda) {
    const std::string& said = messages.all()[0];
    INFO(said);
    const auto names = [&](const char* what) { return said.find(what) != std::string::npos; };
    CHECK(names("ODE_PARALLEL_SAP_BACKEND=cuda is not to be had ("));
    CHECK((names("this build is without CUDA") || names("driver") || names("device")));
  }
  CHECK(dParallelSAPSpaceGetBackend(space) ==
        (cuda ? dParallelSAPBackendCUDA : dParallelSAPBackendAuto));
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
    World world(space, denseCube(200, 1));
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
  std::string here;
  for (const char* const set : {"portable", "sse2", "avx2", "avx512", "neon"})
    if (processorHas(set)) here += (here.empty() ? "" : ", ") + std::string(set);
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
      CHECK(messages.all()[0] == "ODE_PARALLEL_SAP_SIMD=" + set + " is not to be had here (only " +
                                     here + ") and is ignored");
    }
    const Variable no_longer("ODE_PARALLEL_SAP_SIMD", nullptr);
    CHECK(instructionSetInUse() == best);
  }
}

TEST_CASE("ODE_PARALLEL_SAP_STATS=1 tells where the time went when a space ends", "[environment]") {
  const BareEnvironment bare;
  dParallelSAPStats of_pairs, of_contacts;
  const auto messagesOf = [&](const char* value, std::size_t n) {
    const Variable variable("ODE_PARALLEL_SAP_STATS", value);
    const Messages messages;
    {
      const Space space;
      World world(space, denseCube(n, 1));
      collide(space);
      of_pairs = statsOf(space);
      (void)parallelContacts(space, 4);
      of_contacts = statsOf(space);
      REQUIRE(messages.all().empty());
    }
    return messages.all();
  };
  for (const std::size_t n : {100, 1500}) {
    const std::vector<std::string> said = messagesOf("1", n);
    REQUIRE(!said.empty());  // what would have saved time may follow
    INFO(said[0]);
    CHECK(said[0].find(": 2 frames (") != std::string::npos);
    CHECK(of_contacts.contacts > 0);
    CHECK(of_contacts.narrow_ms > 0);
    const auto meanOf = [&](auto statistic) {
      return static_cast<double>(of_pairs.*statistic + of_contacts.*statistic) / 2;
    };
    constexpr double whole = 0.5, digit = 0.00051;
    const struct {
      const char* before;
      double mean, error;
    } numbers[] = {{"a frame: ", meanOf(&dParallelSAPStats::geoms), 0},
                   {" geoms, ", meanOf(&dParallelSAPStats::pairs), whole},
                   {" pairs, ", meanOf(&dParallelSAPStats::contacts), whole},
                   {" contacts, ", meanOf(&dParallelSAPStats::total_ms), digit},
                   {" ms (update ", meanOf(&dParallelSAPStats::update_ms), digit},
                   {", extract ", meanOf(&dParallelSAPStats::extract_ms), digit},
                   {", filter ", meanOf(&dParallelSAPStats::filter_ms), digit},
                   {", narrow ", meanOf(&dParallelSAPStats::narrow_ms), digit},
                   {", report ", meanOf(&dParallelSAPStats::report_ms), digit}};
    for (const auto& [before, mean, error] : numbers) {
      const std::size_t at = said[0].find(before);
      INFO(before << mean);
      REQUIRE(at != std::string::npos);
      CHECK(std::fabs(std::atof(said[0].c_str() + at + std::strlen(before)) - mean) <= error);
    }
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
    World world(space, denseCube(300, 1));
    const dGeomID probe = dCreateSphere(nullptr, 5);
    for (int i = 0; i < 7; ++i) collide2(space, probe);
    dGeomDestroy(probe);
    const dParallelSAPRay rays[30] = {};
    dParallelSAPRayHit hits[30];
    dParallelSAPSpaceRays(space, rays, 30, 0, hits);
    Probes probes;
    for (int i = 0; i < 20; ++i) probes.push_back({world.geoms()[i], nullptr, 0});
    dParallelSAPSpaceOverlaps(space, probes.data(), 20, sizeof probes[0], 1, nullptr, nullptr);
  }
  REQUIRE(messages.all().size() == 1);
  INFO(messages.all()[0]);
  int queries = 0, rays = 0, probes = 0;
  double queries_ms = 0, rays_ms = 0, probes_ms = 0;
  constexpr const char* format =
      "parallel SAP space %*p: dSpaceCollide2 of %d geoms with their callbacks took %lf ms, %d "
      "rays took %lf ms, %d probes took %lf ms";
  REQUIRE(std::sscanf(messages.all()[0].c_str(), format, &queries, &queries_ms, &rays, &rays_ms,
                      &probes, &probes_ms) == 6);
  CHECK(queries == 7);
  CHECK(rays == 30);
  CHECK(probes == 20);
  CHECK(queries_ms > 0);
}

TEST_CASE("ODE_PARALLEL_SAP_STATS=1 names the batches that many dSpaceCollide2 a frame could be",
          "[environment]") {
  const BareEnvironment bare;
  const Variable stats("ODE_PARALLEL_SAP_STATS", "1");
  const auto advised = [](int rays, int geoms, int frames, bool nested) {
    const Messages messages;
    {
      const Space outer, space;
      if (nested) dSpaceAdd(outer, space.geom());
      World world(space, denseCube(300, 1));
      const dGeomID ray = dCreateRay(nullptr, 5), ball = dCreateSphere(nullptr, 5);
      for (int i = 0; i < frames; ++i) collide(space);
      for (int i = 0; i < rays; ++i) collide2(space, ray);
      for (int i = 0; i < geoms; ++i) collide2(space, ball);
      for (const dGeomID geom : {ray, ball}) dGeomDestroy(geom);
      if (nested) dSpaceRemove(outer, space.geom());
    }
    std::string said;
    for (const std::string& line : messages.all())
      if (line.find("would answer") != std::string::npos)
        said += line.substr(line.find(": ") + 2) + "\n";
    return said;
  };
  const std::string of_rays =
      "dParallelSAPSpaceRays would answer 300 dSpaceCollide2 of rays on all threads\n";
  const std::string of_geoms =
      "dParallelSAPSpaceOverlaps would answer 400 dSpaceCollide2 of geoms on all threads\n";
  CHECK(advised(300, 20, 0, false) == of_rays);
  CHECK(advised(20, 400, 3, false) == of_geoms);
  CHECK(advised(300, 400, 1, false) == of_rays + of_geoms);
  CHECK(advised(300, 400, 10, false) == "");
  CHECK(advised(300, 400, 0, true) == "");  // of a space in a space, in the outer one's callback
}
