#ifndef SCENE_PICTURE_H
#define SCENE_PICTURE_H

#include <string>

#include "warehouse.h"

namespace scene {

// Draws the last frame into a PNG file: rays up to their hits, and poses, the free ones in green.
// Throws std::runtime_error.
void draw(const Warehouse& warehouse, const std::string& file);

}  // namespace scene

#endif
