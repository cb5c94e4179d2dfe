#ifndef PILE_OFFSCREEN_H
#define PILE_OFFSCREEN_H

#include <EGL/egl.h>

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

}  // namespace pile

#endif
