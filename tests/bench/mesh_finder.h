// What is compared by mesh-benchmark: something that finds the pairs of boxes within one group, or
// between two.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "mesh_data.h"

namespace bench {

// A frame is move(), not timed, and find().
class MeshFinder {
 public:
  virtual ~MeshFinder() = default;
  // Tells the library that all boxes may be others now, which they are not.
  virtual void move() {}
  // The number of pairs.
  virtual std::size_t find() = 0;
  // Milliseconds of the last find() that are not spent on bringing boxes up to date, on tests that
  // only ODE has, or on handing pairs over; not a number where that is not known.
  virtual double extraction() const;
};

struct MeshFinderKind {
  std::string name, library;
  bool two_groups_only = false;
  // Of the pairs within `a` or, where `b` is not null, of those of a box of each.
  std::unique_ptr<MeshFinder> (*create)(const MeshBoxes& a, const MeshBoxes* b, int threads);
};

void addSpaceFinders(std::vector<MeshFinderKind>& kinds);
void addEmbreeFinders(std::vector<MeshFinderKind>& kinds);

}  // namespace bench
