// Heightfields of every kind of data and pose, which their collider writes to, have the contacts of
// the serial loop.
#include <ode_parallel_sap/parallel_sap_space.h>

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/configurations.h"
#include "support/contact_scene.h"
#include "support/knobs.h"

using namespace sap_test;

namespace {

const int kThreads[] = {1, 2, 3, 7, 16};
constexpr int kSamples = 21;
constexpr dReal kSide = 10;

enum class Heights { Byte, Short, Float, Double, Callback };

struct Field {
  const char* name;
  Heights heights;
  bool placeable, wrapped, copied;
};
constexpr Field fields[] = {
    {"bytes", Heights::Byte, true, false, false},
    {"bytes, copied", Heights::Byte, false, false, true},
    {"shorts", Heights::Short, true, false, false},
    {"floats", Heights::Float, false, false, false},
    {"floats, wrapped", Heights::Float, true, true, false},
    {"doubles, copied", Heights::Double, true, false, true},
    {"callback", Heights::Callback, true, false, false},
    {"callback, wrapped", Heights::Callback, false, true, false},
};

std::atomic<int> callback_calls{0}, callback_calls_elsewhere{0};
const std::thread::id tests_thread = std::this_thread::get_id();

int heightNumber(int x, int z) {
  return (x * 7 + z * 13 + x * z) % 11;
}

dReal heightOf(void*, int x, int z) {
  ++callback_calls;
  if (std::this_thread::get_id() != tests_thread) ++callback_calls_elsewhere;
  return heightNumber(x % kSamples, z % kSamples) * dReal(0.1);
}

template <class T>
const T* samples() {
  static const std::vector<T> all = [] {
    std::vector<T> heights;
    for (int z = 0; z < kSamples; ++z)
      for (int x = 0; x < kSamples; ++x) heights.push_back(static_cast<T>(heightNumber(x, z)));
    return heights;
  }();
  return all.data();
}

dHeightfieldDataID buildData(const Field& field) {
  const dHeightfieldDataID data = dGeomHeightfieldDataCreate();
  const int wrap = field.wrapped, copy = field.copied;
  const dReal scale = dReal(0.1), offset = dReal(0.05), thick = 1;
  switch (field.heights) {
    case Heights::Byte:
      dGeomHeightfieldDataBuildByte(data, samples<unsigned char>(), copy, kSide, kSide, kSamples,
                                    kSamples, scale, offset, thick, wrap);
      break;
    case Heights::Short:
      dGeomHeightfieldDataBuildShort(data, samples<short>(), copy, kSide, kSide, kSamples, kSamples,
                                     scale, offset, thick, wrap);
      break;
    case Heights::Float:
      dGeomHeightfieldDataBuildSingle(data, samples<float>(), copy, kSide, kSide, kSamples,
                                      kSamples, scale, offset, thick, wrap);
      break;
    case Heights::Double:
      dGeomHeightfieldDataBuildDouble(data, samples<double>(), copy, kSide, kSide, kSamples,
                                      kSamples, scale, offset, thick, wrap);
      break;
    case Heights::Callback:
      dGeomHeightfieldDataBuildCallback(data, nullptr, heightOf, kSide, kSide, kSamples, kSamples,
                                        1, offset, thick, wrap);
      break;
  }
  return data;
}

// A heightfield, and another one with the same data where it can be elsewhere.
class Terrain {
 public:
  Terrain(dSpaceID space, const Field& field) : data_(buildData(field)) {
    geoms_.push_back(dCreateHeightfield(space, data_, field.placeable));
    if (!field.placeable) return;
    geoms_.push_back(dCreateHeightfield(space, data_, 1));
    dMatrix3 rotation;
    dRFromAxisAndAngle(rotation, 1, dReal(0.2), dReal(0.1), dReal(1.2));
    dGeomSetRotation(geoms_.back(), rotation);
    dGeomSetPosition(geoms_.back(), dReal(0.3), dReal(0.4), dReal(0.2));
  }
  ~Terrain() {
    for (const dGeomID geom : geoms_) dGeomDestroy(geom);
    dGeomHeightfieldDataDestroy(data_);
  }
  Terrain(const Terrain&) = delete;
  Terrain& operator=(const Terrain&) = delete;

 private:
  const dHeightfieldDataID data_;
  std::vector<dGeomID> geoms_;
};

}  // namespace

TEST_CASE("Contacts with heightfields of all kinds are those of the serial loop", "[heightfield]") {
  const std::uint64_t seed = seedOr(121);
  for (const Field& field : fields) {
    const Space space;
    Terrain terrain(space, field);
    ContactScene scene(space);
    const std::vector<Kind> kinds = {Kind::Sphere, Kind::Box,   Kind::Capsule, Kind::Cylinder,
                                     Kind::Convex, Kind::Torus, Kind::Ray,     Kind::OffsetBox};
    for (std::uint64_t i = 0; i < 240; ++i) scene.add(kinds[i % kinds.size()], 4, seed + i);
    for (const int threads : kThreads) {
      scene.move(seed + static_cast<std::uint64_t>(threads));
      const Contacts expected = serialContacts(space, {16});
      std::size_t with_fields = 0;
      for (const Contact& contact : expected)
        with_fields += dGeomGetClass(contact.g1) == dHeightfieldClass ||
                       dGeomGetClass(contact.g2) == dHeightfieldClass;
      INFO(field.name << ", " << threads << " threads, ODE_PARALLEL_SAP_TEST_SEED=" << seed);
      REQUIRE(with_fields > 100);
      dParallelSAPSpaceSetNumThreads(space, threads);
      callback_calls = 0;
      REQUIRE(difference(parallelContacts(space, 16), expected) == "");
      CHECK((callback_calls > 0) == (field.heights == Heights::Callback));
    }
  }
  CHECK(callback_calls_elsewhere == 0);
}
