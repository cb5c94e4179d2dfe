// A private image of ODE: the program's own libode once more, with caches and tables of its own.
// Sees ODE's private headers.
#pragma once

#include <cstddef>

#include "space/contacts/library_copy.h"
#include "space/geom/ode_private.h"

namespace ode_parallel_sap {

// Functions of ODE that one thread may call while others call those of the program's ODE or of
// other images. It is the same machine code, so its colliders find the same contacts; geoms are the
// program's, and their virtual functions are its, too.
//
// What ODE 0.16 keeps in static variables, and what becomes of it in an image:
// - the trimesh colliders' cache (where there is no thread-local storage), the list of one free
//   pose: the image's own, which is what it is for;
// - the table of colliders: the image's own, as ODE makes it. What dSetColliderOverride changed in
//   the program's is seen by comparing the two (`hasProgramsCollider`);
// - classes of the user: the program's alone;
// - functions for messages and errors: the image's hand on to the program's (dMessage, dError,
//   dDebug), whatever those are at that time;
// - functions for memory (dSetAllocHandler): the image's own, which are malloc's. What an image
//   allocates, a cache or a geom within a collider, it also frees;
// - the count of dInitODE2, thread-local storage, OPCODE's and OU's handlers, default threading:
//   the image's own, made ready when it is loaded and never closed;
// - random numbers, clocks, worlds' tags: no collider reads them. libccd has none.
class OdeImage {
 public:
  // Loads one, for the life of the process. Null, or why it could not.
  const char* load();

  // dCollide of the image.
  int collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) const {
    return collide_(a, b, flags, contacts, skip);
  }
  // Whether the program's ODE has a collider for these classes, and the image the same.
  bool hasProgramsCollider(int class_a, int class_b) const {
    const Entry &own = own_table_->entries[class_a][class_b],
                &program = programs_table_->entries[class_a][class_b];
    return own.collider && program.collider && own.reverse == program.reverse &&
           address(own) - copy_.library().base == address(program) - program_base_;
  }
  // Bytes of a geom of this class, 0 where it is not known.
  std::size_t sizeOf(int geom_class) const { return sizes_[geom_class]; }
  // A heightfield without place and its data, which belong to the image.
  dxGeom* heightfield() const { return heightfield_; }
  dHeightfieldDataID heightfieldData() const { return heightfield_data_; }

  void* symbol(const char* name) const { return copy_.symbol(name); }
  const LoadedLibrary& library() const { return copy_.library(); }
  std::uintptr_t programBase() const { return program_base_; }
  // The first place among the variables that `is` takes for a T, or null.
  template <class T, class Is>
  const T* findVariable(Is is) const {
    for (const Segment& segment : copy_.library().segments) {
      if (!segment.writable) continue;
      constexpr std::uintptr_t step = alignof(T);
      std::uintptr_t at = (segment.begin + step - 1) / step * step;
      for (; at + sizeof(T) <= segment.end; at += step)
        if (const T& variable = *reinterpret_cast<const T*>(at); is(variable)) return &variable;
    }
    return nullptr;
  }

 private:
  // As in ODE's collision_kernel.cpp.
  struct Entry {
    dColliderFn* collider;
    int reverse;
  };
  struct Table {
    Entry entries[dGeomNumClasses][dGeomNumClasses];
  };

  static std::uintptr_t address(const Entry& entry) {
    return reinterpret_cast<std::uintptr_t>(entry.collider);
  }
  const char* loadCopy();
  bool initialise();
  const Table* findTable() const;
  bool isTable(const Table& table) const;
  bool learnSizes();
  bool makeHeightfield();

  LibraryCopy copy_;
  std::uintptr_t program_base_ = 0;
  decltype(&dCollide) collide_ = nullptr;
  const Table* own_table_ = nullptr;
  const Table* programs_table_ = nullptr;
  std::size_t sizes_[dGeomNumClasses] = {};
  dxGeom* heightfield_ = nullptr;
  dHeightfieldDataID heightfield_data_ = nullptr;
};

}  // namespace ode_parallel_sap
