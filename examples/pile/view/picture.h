#ifndef PILE_PICTURE_H
#define PILE_PICTURE_H

#include <string>
#include <vector>

namespace pile {

struct Picture {
  int width;
  int height;
  std::vector<unsigned char> pixels;  // red, green, blue; the bottom row first
};

// What OpenGL's current context has drawn but not yet shown.
Picture readPicture();

// A quarter of the pixels, each the mean of four. Width and height must be even.
Picture halved(const Picture& picture);

// Throws std::runtime_error if the file cannot be written.
void writePng(const Picture& picture, const std::string& file);

}  // namespace pile

#endif
