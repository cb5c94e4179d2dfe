#include "offscreen.h"

#include <EGL/eglext.h>

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

}  // namespace pile
