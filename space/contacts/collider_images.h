// Private images of ODE for the threads of a team. Sees ODE's private headers.
#pragma once

#include <cstddef>
#include <vector>

#include "space/contacts/geom_copies.h"
#include "space/contacts/ode_image.h"

namespace ode_parallel_sap {

// One thread's image, and what it needs beside it.
class ColliderImage {
 public:
  // Null, or why there is none.
  const char* load() { return image_.load(); }
  // Whether collide() does what the program's dCollide would do, the program's geoms apart, to
  // which it does nothing. Of the pairs that colliderUse() means for images.
  bool serves(const dxGeom* a, const dxGeom* b) const {
    return image_.hasProgramsCollider(a->type, b->type) &&
           (!hasHeightfield(a, b) || GeomCopies::serve(image_, a, b));
  }
  // As dCollide.
  int collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) {
    return hasHeightfield(a, b) ? stand_ins_.collide(image_, a, b, flags, contacts, skip)
                                : image_.collide(a, b, flags, contacts, skip);
  }

 private:
  static bool hasHeightfield(const dxGeom* a, const dxGeom* b) {
    return a->type == dHeightfieldClass || b->type == dHeightfieldClass;
  }

  OdeImage image_;
  GeomCopies stand_ins_;
};

// Images that are lent to this object as long as it lives: one for each of up to `wanted` threads,
// for so many pairs. None where there are not two of them, or where ODE is closed meanwhile.
//
// Images are the process's, and no two spaces have one at a time. They are loaded when there have
// been pairs enough to pay for it, and kept for the life of the process, through fork and exit.
// The first that cannot be loaded ends that; dMessage tells why, once.
class ColliderImages {
 public:
  ColliderImages(int wanted, std::size_t pairs);
  ~ColliderImages();
  ColliderImages(const ColliderImages&) = delete;
  ColliderImages& operator=(const ColliderImages&) = delete;

  int count() const { return static_cast<int>(lent_.size()); }
  ColliderImage& operator[](int thread) const { return *lent_[static_cast<std::size_t>(thread)]; }

 private:
  std::vector<ColliderImage*> lent_;
};

}  // namespace ode_parallel_sap
