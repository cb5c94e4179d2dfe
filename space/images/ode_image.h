// A private image of ODE: the program's own libode once more, with caches and tables of its own.
#pragma once

#include <dlfcn.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "space/contacts/collider_threads.h"
#include "space/geoms/ode_private.h"

namespace ode_parallel_sap {

// A part of a loaded library, in memory.
struct Segment {
  std::uintptr_t begin, end;
  bool writable;
};

struct LoadedLibrary {
  std::uintptr_t base = 0;
  std::string path;  // of the file it was loaded from; empty for the program itself
  std::vector<Segment> segments;
  std::size_t dynamic_begin = 0, dynamic_end = 0;  // the dynamic section's place in the file
};

// The library that an address of this process lies in; without segments if none.
LoadedLibrary libraryAt(const void* address);

// Functions of ODE that one thread may call while others call those of the program's ODE or of
// other images. It is the same machine code, so its colliders find the same contacts; geoms are the
// program's, and their virtual functions are its, too.
//
// | static variables of ODE 0.16 | in an image |
// | --- | --- |
// | cache of the trimesh colliders, list of one free pose | its own |
// | table of colliders | its own; `serves` compares it with the program's |
// | classes of the user | none |
// | functions for messages and errors | they call the program's |
// | functions for memory | malloc's; an image frees whatever it allocates |
// | count of dInitODE2, thread-local storage, OPCODE's and OU's handlers | its own, never closed |
// | random numbers, clocks, tags of worlds | no collider reads them |
//
// It is loaded from a file in memory, in which DT_SYMBOLIC has taken the place of the library's
// DT_SONAME. So it finds its own functions and variables first, and nobody gets it by its name.
// (RTLD_DEEPBIND would bind malloc past what a program preloads.)
//
// ODE's collider of heightfields writes into the heightfield, its data and the other geom. Here it
// does that to copies, whose storage is reused. None of it is left in the contacts.
class OdeImage final : public ThreadCollider {
 public:
  // Loads one, for the life of the process. Null, or why it could not.
  const char* load();

  // Of heightfields, those whose heights are no callback's, with a class of known size.
  bool serves(const dxGeom* a, const dxGeom* b) const override;
  int collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) override;

  // Null if there is none.
  void* symbol(const char* name) const { return dlsym(handle_, name); }

 private:
  // As in ODE's collision_kernel.cpp.
  struct Entry {
    dColliderFn* collider;
    int reverse;
  };
  using Table = Entry[dGeomNumClasses][dGeomNumClasses];

  const char* loadCopy(const LoadedLibrary& original);
  const Table* findTable() const;
  void makeHeightfield();
  dxGeom* heightfieldLike(const dxGeom* original);
  dxGeom* copyOf(const dxGeom* geom);

  void* handle_ = nullptr;
  LoadedLibrary library_;
  std::uintptr_t program_base_ = 0;
  decltype(&dCollide) collide_ = nullptr;
  const Table* own_table_ = nullptr;
  const Table* programs_table_ = nullptr;
  // Bytes of a geom of a class from spheres to convexes, and of a mesh; 0 where not known.
  std::size_t sizes_[dGeomNumClasses] = {
      sizeof(dxSphere), sizeof(dxBox),   sizeof(dxCapsule), sizeof(dxCylinder), 0,
      sizeof(dxRay),    sizeof(dxConvex)};
  dxGeom* heightfield_ = nullptr;  // without place
  dHeightfieldDataID heightfield_data_ = nullptr;
  std::vector<double> bytes_;  // of the geom that meets a heightfield
  dxPosR pose_;                // likewise
};

}  // namespace ode_parallel_sap
