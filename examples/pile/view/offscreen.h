#ifndef PILE_OFFSCREEN_H
#define PILE_OFFSCREEN_H

#include <EGL/egl.h>

#include <string>

namespace pile {

// An OpenGL context that draws into memory, current on the thread that made it. Needs neither a
// display nor a GPU: Mesa draws in software where there is none.
class Offscreen {
 public:
  // Throws UsageError if EGL has no such context to give.
  Offscreen(int width, int height);
  ~Offscreen();
  Offscreen(const Offscreen&) = delete;
  Offscreen& operator=(const Offscreen&) = delete;

 private:
  EGLDisplay display_;
};

// Writes what the current context has drawn but not yet shown into a PNG file. A pixel of the
// picture is the mean of `sharing` by `sharing` that were drawn. Throws std::runtime_error.
void savePicture(const std::string& file, int sharing);

}  // namespace pile

#endif
