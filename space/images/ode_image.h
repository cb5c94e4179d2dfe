// A private image of ODE: the program's own libode once more, with caches and tables of its own.
// Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <vector>

#include "space/contacts/thread_colliders.h"
#include "space/geoms/ode_private.h"
#include "space/images/library_copy.h"

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
//
// ODE's collider of heightfields keeps its triangles in the heightfield and its contacts with a
// plane in the heightfield's data, and puts the other geom, or its body, into the heightfield's
// frame for a while. Here it does all that to copies: the heightfield and the data are the image's,
// which takes on the values of the program's; of the other geom, bytes and pose are copied into
// storage that is reused. None of it is left in the contacts. Whatever the collider reads it has
// written before, for the same pair, so contacts do not depend on what the buffers held.
class OdeImage final : public ThreadCollider {
 public:
  // Loads one, for the life of the process. Null, or why it could not.
  const char* load();

  // Of heightfields, those whose heights are no callback's, with a class of known size.
  bool serves(const dxGeom* a, const dxGeom* b) const override;
  int collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) override;

  // Whether the program's ODE has a collider for these classes, and the image the same.
  bool hasProgramsCollider(int class_a, int class_b) const {
    const Entry &own = own_table_->entries[class_a][class_b],
                &program = programs_table_->entries[class_a][class_b];
    return own.collider && program.collider && own.reverse == program.reverse &&
           address(own) - copy_.library().base == address(program) - program_base_;
  }
  void* symbol(const char* name) const { return copy_.symbol(name); }

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
  bool initialise();
  const Table* findTable() const;
  bool isTable(const Table& table) const;
  bool learnSizes();
  bool makeHeightfield();
  dxGeom* heightfieldLike(const dxGeom* original);
  dxGeom* copyOf(const dxGeom* geom);

  LibraryCopy copy_;
  std::uintptr_t program_base_ = 0;
  decltype(&dCollide) collide_ = nullptr;
  const Table* own_table_ = nullptr;
  const Table* programs_table_ = nullptr;
  std::size_t sizes_[dGeomNumClasses] = {};  // bytes of a geom of a class, 0 where not known
  dxGeom* heightfield_ = nullptr;            // without place
  dHeightfieldDataID heightfield_data_ = nullptr;
  std::vector<double> bytes_;  // of the geom that meets a heightfield
  dxPosR pose_;                // likewise
};

}  // namespace ode_parallel_sap
