#ifndef PILE_LETTER_OUTLINES_H
#define PILE_LETTER_OUTLINES_H

#include "polygon.h"

namespace pile {

// The outline of a capital letter (0 is A) one unit high, drawn with a stroke of this width (0.14
// to 0.23). The number of points depends on the letter alone.
Region letterOutline(int letter, double stroke);

}  // namespace pile

#endif
