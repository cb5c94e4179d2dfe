#include "picture.h"

#include <GL/gl.h>
#include <png.h>

#include <stdexcept>

namespace pile {

Picture readPicture() {
  GLint viewport[4];
  glGetIntegerv(GL_VIEWPORT, viewport);
  Picture picture = {viewport[2], viewport[3], {}};
  picture.pixels.resize(3 * static_cast<size_t>(picture.width) *
                        static_cast<size_t>(picture.height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, picture.width, picture.height, GL_RGB, GL_UNSIGNED_BYTE,
               picture.pixels.data());
  return picture;
}

Picture halved(const Picture& picture) {
  Picture half = {picture.width / 2, picture.height / 2, {}};
  const size_t row = 3 * static_cast<size_t>(picture.width);
  for (size_t y = 0; y < static_cast<size_t>(half.height); ++y)
    for (size_t x = 0; x < static_cast<size_t>(half.width); ++x)
      for (size_t colour = 0; colour < 3; ++colour) {
        const unsigned char* first = &picture.pixels[2 * y * row + 6 * x + colour];
        half.pixels.push_back(static_cast<unsigned char>(
            (first[0] + first[3] + first[row] + first[row + 3] + 2) / 4));
      }
  return half;
}

void writePng(const Picture& picture, const std::string& file) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  const png_int_32 bottom_up = -3 * picture.width;
  if (!png_image_write_to_file(&image, file.c_str(), 0, picture.pixels.data(), bottom_up, nullptr))
    throw std::runtime_error("cannot write the picture " + file + ": " + image.message);
}

}  // namespace pile
