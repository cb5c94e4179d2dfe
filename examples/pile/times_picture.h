#ifndef PILE_TIMES_PICTURE_H
#define PILE_TIMES_PICTURE_H

#include <string>

#include "comparison.h"
#include "report.h"

namespace pile {

// Draws the parts of the mean step as bars into an SVG file, which any browser shows: a bar as long
// as its part's share of the step, where the whole step is as long as times_picture_length. Below
// are the steps of `ways`, the longest as long as that. False if the file cannot be written to its
// end.
bool writeTimesPicture(const Totals& totals, const std::vector<Way>& ways, const World& world,
                       const Options& options, const std::string& file);

constexpr double times_picture_length = 600;  // pixels

}  // namespace pile

#endif
