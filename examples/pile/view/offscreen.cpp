#include "offscreen.h"

#include <EGL/eglext.h>
#include <GL/gl.h>
#include <png.h>

#include <vector>

#include "../options.h"

namespace pile {
namespace {

EGLDisplay openDisplay() {
  const EGLDisplay displays[] = {
      eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
      eglGetDisplay(EGL_DEFAULT_DISPLAY)};
  for (const EGLDisplay display : displays)
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr)) return display;
  throw UsageError(
      "--snapshot finds no OpenGL to draw with: EGL cannot be initialised (Debian: libgl1-mesa-dri "
      "draws without a GPU)");
}

bool makeContext(EGLDisplay display, int width, int height) {
  constexpr EGLint wanted[] = {EGL_SURFACE_TYPE,
                               EGL_PBUFFER_BIT,
                               EGL_RENDERABLE_TYPE,
                               EGL_OPENGL_BIT,
                               EGL_RED_SIZE,
                               8,
                               EGL_GREEN_SIZE,
                               8,
                               EGL_BLUE_SIZE,
                               8,
                               EGL_DEPTH_SIZE,
                               24,
                               EGL_NONE};
  const EGLint size[] = {EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
  EGLConfig config;
  EGLint count = 0;
  if (!eglBindAPI(EGL_OPENGL_API) || !eglChooseConfig(display, wanted, &config, 1, &count) ||
      count == 0)
    return false;
  const EGLSurface surface = eglCreatePbufferSurface(display, config, size);
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, nullptr);
  return surface != EGL_NO_SURFACE && context != EGL_NO_CONTEXT &&
         eglMakeCurrent(display, surface, surface, context);
}

}  // namespace

Offscreen::Offscreen(int width, int height) : display_(openDisplay()) {
  if (makeContext(display_, width, height)) return;
  eglTerminate(display_);
  throw UsageError("--snapshot finds no OpenGL to draw with: EGL gives no off-screen context");
}

Offscreen::~Offscreen() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglTerminate(display_);  // with all that was made on it
}

void savePicture(const std::string& file, int sharing) {
  GLint viewport[4];
  glGetIntegerv(GL_VIEWPORT, viewport);
  const auto width = static_cast<size_t>(viewport[2] / sharing);
  const auto height = static_cast<size_t>(viewport[3] / sharing),
             side = static_cast<size_t>(sharing);
  const size_t row = 3 * static_cast<size_t>(viewport[2]);
  std::vector<unsigned char> drawn(row * static_cast<size_t>(viewport[3])), pixels;
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, viewport[2], viewport[3], GL_RGB, GL_UNSIGNED_BYTE, drawn.data());
  for (size_t y = 0; y < height; ++y)
    for (size_t x = 0; x < width; ++x)
      for (size_t colour = 0; colour < 3; ++colour) {
        size_t sum = 0;
        for (size_t i = 0; i < side * side; ++i)
          sum += drawn[(side * y + i / side) * row + 3 * (side * x + i % side) + colour];
        pixels.push_back(static_cast<unsigned char>(sum / (side * side)));
      }
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  const auto bottom_up = -static_cast<png_int_32>(3 * width);
  if (!png_image_write_to_file(&image, file.c_str(), 0, pixels.data(), bottom_up, nullptr))
    throw std::runtime_error("cannot write the picture " + file + ": " + image.message);
}

}  // namespace pile
