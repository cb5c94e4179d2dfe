// Boxes cut into cells, which are numbered through all classes.
#pragma once

#include <cstddef>

namespace ode_parallel_sap {

// Has the cells [first_cell, last_cell).
struct CellClass {
  std::size_t first_cell, last_cell;
};
// Classes that follow each other, from cell 0 on.
struct CellClasses {
  const CellClass* first;
  std::size_t count;
};

}  // namespace ode_parallel_sap
