#ifndef PILE_SCENES_H
#define PILE_SCENES_H

#include "random.h"
#include "world.h"

namespace pile {

// Each fills an empty world with static geometry first, then `bodies` bodies at rest in the air
// above it, placed, turned and sized by `random`. Lengths are in metres, densities in kg per cubic
// metre over 1000.
void buildCubes(World& world, int bodies, Random& random);
void buildBalls(World& world, int bodies, Random& random);
void buildSkittles(World& world, int bodies, Random& random);
void buildTorus(World& world, int bodies, Random& random);
void buildAlphabet(World& world, int bodies, Random& random);

}  // namespace pile

#endif
