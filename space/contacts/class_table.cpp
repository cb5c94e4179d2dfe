#include "space/contacts/class_table.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <new>
#include <utility>

#include "space/contacts/ode_image.h"
#include "space/geom/user_classes.h"

namespace ode_parallel_sap {

namespace {

// Classes that stand for nothing but themselves: none has a function of another's.
template <int number>
struct Mark {
  static void bounds(dxGeom*, dReal aabb[6]) { std::fill(aabb, aabb + 6, dReal(number)); }
  static int test(dxGeom*, dxGeom*, dReal[6]) { return number; }
  static dColliderFn* collider(int) { return nullptr; }
  static constexpr dGeomClass value = {8 * number, collider, bounds, test, nullptr};
};

struct Table {
  dGeomClass classes[dMaxUserClasses];
};

template <int... numbers>
constexpr Table tableOf(std::integer_sequence<int, numbers...>) {
  return {{Mark<numbers + 1>::value...}};
}
constexpr Table marks = tableOf(std::make_integer_sequence<int, dMaxUserClasses>());

bool isSame(const dGeomClass& a, const dGeomClass& b) {
  return a.bytes == b.bytes && a.collider == b.collider && a.aabb == b.aabb &&
         a.aabb_test == b.aabb_test && a.dtor == b.dtor;
}

bool hasMarks(const Table& table) {
  return std::equal(std::begin(marks.classes), std::end(marks.classes), table.classes, isSame);
}

// What is at the place of the program's ODE at which the image has `of_image`.
template <class T>
const T* ofProgram(const OdeImage& image, const T* of_image) {
  return reinterpret_cast<const T*>(reinterpret_cast<std::uintptr_t>(of_image) -
                                    image.library().base + image.programBase());
}

// The image's table of virtual functions of geoms of the user's classes.
const void* const* functionsOf(const OdeImage& image, int user_class) {
  const auto create = reinterpret_cast<decltype(&dCreateGeom)>(image.symbol("dCreateGeom"));
  const auto destroy = reinterpret_cast<decltype(&dGeomDestroy)>(image.symbol("dGeomDestroy"));
  if (!create || !destroy) return nullptr;
  dxGeom* const geom = create(user_class);
  const void* const* functions;
  std::memcpy(&functions, static_cast<const void*>(geom), sizeof functions);
  destroy(geom);
  return functions;
}

// Whether the program's geoms do what the image's do: each function is the same, counted from where
// either library begins.
bool areSame(const OdeImage& image, const void* const* functions) {
  constexpr int count = 4;  // fixed: two destructors, computeAABB, AABBTest
  for (int i = 0; i < count; ++i)
    if (ofProgram(image, static_cast<const char*>(functions[i])) != ofProgram(image, functions)[i])
      return false;
  return true;
}

// Null, or why it could not.
const char* find(OdeImage& image, UserClasses& found) {
  if (const char* const why = image.load()) return why;
  const char* const not_there = "ODE's table of classes is not where it was";
  const auto create =
      reinterpret_cast<decltype(&dCreateGeomClass)>(image.symbol("dCreateGeomClass"));
  if (!create) return not_there;
  for (const dGeomClass& mark : marks.classes) create(&mark);
  const Table* const table = image.findVariable<Table>(hasMarks);
  if (!table) return not_there;
  const void* const* const functions = functionsOf(image, dFirstUserClass);
  if (!functions || !areSame(image, functions)) return "the program's geoms are not ODE's";
  found = {ofProgram(image, table)->classes, ofProgram(image, functions)};
  return nullptr;
}

}  // namespace

void findUserClasses() {
  static std::atomic<bool> tried{false};
  if (tried.exchange(true)) return;
  // Neither is ever destroyed: other threads may look into the table when the process ends.
  const char* why = "there is no memory for it";
  try {
    static OdeImage& image = *new OdeImage;
    static UserClasses& found = *new UserClasses;
    why = find(image, found);
    if (!why) user_classes.store(&found, std::memory_order_release);
  } catch (const std::bad_alloc&) {
  }
  if (why)
    dMessage(0,
             "parallel SAP space: it cannot be known which of the user's classes have an AABBTest, "
             "so pairs of all are tested by the calling thread: %s",
             why);
}

}  // namespace ode_parallel_sap
