#ifndef PILE_LETTERS_H
#define PILE_LETTERS_H

#include "mesh.h"

namespace pile {

constexpr int letter_count = 26;
constexpr int letter_variation_count = 10;

// A capital letter of closed bars, one a stroke of the pen: letter 0 is A; the variations differ in
// size, stroke, slant and depth. The 26 letters of one variation have 3,168 triangles, so the 260
// bodies of the alphabet scene have 31,680. Where strokes overlap, the mass counts twice.
Mesh makeLetter(int letter, int variation);

}  // namespace pile

#endif
