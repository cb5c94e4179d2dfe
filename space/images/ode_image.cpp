#include "space/images/ode_image.h"

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "space/geoms/ode_heightfield.h"

namespace ode_parallel_sap {

namespace {

// What the program's ODE makes of it where no function is set differs from message to error, and
// it takes a text only by an ellipsis.
template <void (*tell)(int, const char*, ...), dMessageFunction* (*programs)()>
void handOn(int number, const char* format, va_list arguments) {
  if (dMessageFunction* const function = programs()) {
    function(number, format, arguments);
    return;
  }
  char text[1000];
  std::vsnprintf(text, sizeof text, format, arguments);
  tell(number, "%s", text);
}

// The size of the first thing that an image allocates; one image is loaded by one thread.
thread_local std::size_t first_size = 0;

void* noteAllocation(std::size_t size) {
  if (first_size == 0) first_size = size;
  return std::malloc(size);
}

// Colliders that stand for nothing but themselves.
int mark(dGeomID, dGeomID, int, dContactGeom*, int) {
  return 0;
}
int otherMark(dGeomID, dGeomID, int, dContactGeom*, int) {
  return 1;
}

bool isHeightfield(const dxGeom* geom) {
  return geom->type == dHeightfieldClass;
}

// A function of an image by its name in ODE's headers.
#define IN_IMAGE(function) reinterpret_cast<decltype(&(function))>(symbol(#function))

}  // namespace

// The text of its configuration lies in ODE's library itself, where the address of a function may
// be that of a stub in the program or of what a preloaded library has in its place.
const char* OdeImage::load() {
  const LoadedLibrary original = libraryAt(dGetConfiguration());
  program_base_ = original.base;
  if (const char* const why = copy_.load(original, "libode.so")) return why;
  if (!initialise()) return "a copy of ODE does not begin to work";
  own_table_ = findTable();
  if (!own_table_ || copyFails("table")) return "ODE's table of colliders is not where it was";
  const std::uintptr_t place = reinterpret_cast<std::uintptr_t>(own_table_) - copy_.library().base;
  programs_table_ = reinterpret_cast<const Table*>(program_base_ + place);
  if (!learnSizes() || !makeHeightfield()) return "ODE's geoms are not laid out as expected";
  return nullptr;
}

bool OdeImage::initialise() {
  const auto set_message = IN_IMAGE(dSetMessageHandler);
  const auto set_error = IN_IMAGE(dSetErrorHandler);
  const auto set_debug = IN_IMAGE(dSetDebugHandler);
  const auto init = IN_IMAGE(dInitODE2);
  const auto allocate = IN_IMAGE(dAllocateODEDataForThread);
  collide_ = IN_IMAGE(dCollide);
  if (!set_message || !set_error || !set_debug || !init || !allocate || !collide_) return false;
  set_message(handOn<dMessage, dGetMessageHandler>);
  set_error(handOn<dError, dGetErrorHandler>);
  set_debug(handOn<dDebug, dGetDebugHandler>);
  return init(0) && allocate(static_cast<unsigned>(dAllocateMaskAll));
}

// ODE does not tell where its table of colliders is, but what is written into it is found again.
const OdeImage::Table* OdeImage::findTable() const {
  const auto set_collider = IN_IMAGE(dSetColliderOverride);
  if (!set_collider) return nullptr;
  set_collider(dFirstUserClass, dFirstUserClass, mark);
  set_collider(dLastUserClass, dLastUserClass, otherMark);
  const Table* found = nullptr;
  for (const Segment& segment : copy_.library().segments) {
    constexpr std::uintptr_t step = alignof(Table);
    std::uintptr_t at = (segment.begin + step - 1) / step * step;
    for (; segment.writable && !found && at + sizeof(Table) <= segment.end; at += step)
      if (isTable(*reinterpret_cast<const Table*>(at))) found = reinterpret_cast<const Table*>(at);
  }
  set_collider(dFirstUserClass, dFirstUserClass, nullptr);
  set_collider(dLastUserClass, dLastUserClass, nullptr);
  return found;
}

// With both marks in it, and with a collider of the image's own code for two boxes.
bool OdeImage::isTable(const Table& table) const {
  if (table.entries[dFirstUserClass][dFirstUserClass].collider != mark ||
      table.entries[dLastUserClass][dLastUserClass].collider != otherMark)
    return false;
  const std::uintptr_t of_boxes = address(table.entries[dBoxClass][dBoxClass]);
  for (const Segment& segment : copy_.library().segments)
    if (!segment.writable && segment.holds(of_boxes)) return true;
  return false;
}

// By the memory that the image asks for when it makes a geom of a class: the private headers of
// meshes would need OPCODE's, and sizes are then those of this very library.
bool OdeImage::learnSizes() {
  const auto set_alloc = IN_IMAGE(dSetAllocHandler);
  const auto destroy = IN_IMAGE(dGeomDestroy);
  if (!set_alloc || !destroy) return false;
  const auto learn = [&](int geom_class, auto create, auto... arguments) {
    if (!create) return;
    first_size = 0;
    dxGeom* const geom = create(nullptr, arguments...);
    sizes_[geom_class] = first_size;
    destroy(geom);
  };
  constexpr dReal one = 1;
  static dReal numbers[4] = {};  // not const, for forks
  static unsigned none[1] = {};
  set_alloc(noteAllocation);
  learn(dSphereClass, IN_IMAGE(dCreateSphere), one);
  learn(dBoxClass, IN_IMAGE(dCreateBox), one, one, one);
  learn(dCapsuleClass, IN_IMAGE(dCreateCapsule), one, one);
  learn(dCylinderClass, IN_IMAGE(dCreateCylinder), one, one);
  learn(dRayClass, IN_IMAGE(dCreateRay), one);
  learn(dConvexClass, IN_IMAGE(dCreateConvex), numbers, 0, numbers, 1, none);
  if (dCheckConfiguration("ODE_EXT_trimesh"))
    learn(dTriMeshClass, IN_IMAGE(dCreateTriMesh), nullptr, nullptr, nullptr, nullptr);
  set_alloc(nullptr);
  return sizes_[dSphereClass] > sizeof(dxGeom) && sizes_[dBoxClass] > sizes_[dSphereClass];
}

bool OdeImage::makeHeightfield() {
  const auto create_data = IN_IMAGE(dGeomHeightfieldDataCreate);
  const auto build = IN_IMAGE(dGeomHeightfieldDataBuildSingle);
  const auto create = IN_IMAGE(dCreateHeightfield);
  if (!create_data || !build || !create) return false;
  static const float heights[12] = {};
  heightfield_data_ = create_data();
  build(heightfield_data_, heights, 0, 5, 7, 3, 4, 2, 11, 13, 1);
  heightfield_ = create(nullptr, heightfield_data_, 0);
  const dxHeightfieldData& data = *heightfield_data_;
  return heightfield_->type == dHeightfieldClass &&
         static_cast<const dxHeightfield*>(heightfield_)->m_p_data == &data && data.m_fWidth == 5 &&
         data.m_fDepth == 7 && data.m_nWidthSamples == 3 && data.m_nDepthSamples == 4 &&
         data.m_fScale == 2 && data.m_fOffset == 11 && data.m_fThickness == 13 &&
         data.m_bWrapMode == 1 && data.m_nGetHeightMode == 3 && data.m_pHeightData == heights &&
         !data.m_pGetHeightCallback;
}

#undef IN_IMAGE

bool OdeImage::serves(const dxGeom* a, const dxGeom* b) const {
  if (!hasProgramsCollider(a->type, b->type)) return false;
  const dxGeom *const field = isHeightfield(a) ? a : b, *const other = field == a ? b : a;
  return !isHeightfield(field) ||
         (sizes_[other->type] != 0 && other->final_posr &&
          !static_cast<const dxHeightfield*>(field)->m_p_data->m_pGetHeightCallback);
}

int OdeImage::collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) {
  const bool field_first = isHeightfield(a);
  if (!field_first && !isHeightfield(b)) return collide_(a, b, flags, contacts, skip);
  dxGeom *const field = heightfieldLike(field_first ? a : b), *const other =
                                                                  copyOf(field_first ? b : a);
  const int count =
      collide_(field_first ? field : other, field_first ? other : field, flags, contacts, skip);
  const auto original = [&](dxGeom* geom) { return (geom == field) == field_first ? a : b; };
  for (int i = 0; i < count; ++i) {
    dContactGeom& contact =
        *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) + i * skip);
    contact.g1 = original(contact.g1);
    contact.g2 = original(contact.g2);
  }
  return count;
}

// Makes the image's heightfield one like `original`. It keeps its buffers, and reads the pose where
// it is. What is copied of a geom begins after the pointer to its virtual functions.
dxGeom* OdeImage::heightfieldLike(const dxGeom* original) {
  constexpr std::size_t from = sizeof(void*);
  std::memcpy(reinterpret_cast<char*>(heightfield_) + from,
              reinterpret_cast<const char*>(original) + from, sizeof(dxGeom) - from);
  const dxHeightfieldData& data = *static_cast<const dxHeightfield*>(original)->m_p_data;
  const std::size_t before_scratch = static_cast<std::size_t>(
      reinterpret_cast<const char*>(&data.m_contacts) - reinterpret_cast<const char*>(&data));
  std::memcpy(static_cast<void*>(heightfield_data_), &data, before_scratch);
  heightfield_data_->m_pGetHeightCallback = data.m_pGetHeightCallback;
  return heightfield_;
}

dxGeom* OdeImage::copyOf(const dxGeom* geom) {
  const std::size_t size = sizes_[geom->type];
  bytes_.resize((size + sizeof(double) - 1) / sizeof(double));
  std::memcpy(bytes_.data(), static_cast<const void*>(geom), size);
  dxGeom* const copy = reinterpret_cast<dxGeom*>(bytes_.data());
  pose_ = *geom->final_posr;
  copy->final_posr = &pose_;
  return copy;
}

}  // namespace ode_parallel_sap
