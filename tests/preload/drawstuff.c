/* A drawstuff without a window, as far as ODE's demos here need one: runs a number of frames and
 * presses keys.
 *
 *     DRAWSTUFF_FRAMES=200 DRAWSTUFF_KEYS=bsc demo_boxstack
 *
 * One key a frame, again from the first after the last. Keys and frames are all a demo sees; what
 * it draws goes nowhere. */
#include <drawstuff/drawstuff.h>
#include <stdlib.h>
#include <string.h>

#pragma GCC diagnostic ignored "-Wunused-parameter"

void dsSimulationLoop(int argc, char** argv, int width, int height, dsFunctions* functions) {
  const char* const frames = getenv("DRAWSTUFF_FRAMES");
  const char* const keys = getenv("DRAWSTUFF_KEYS");
  const int count = frames ? atoi(frames) : 100;
  const size_t key_count = keys ? strlen(keys) : 0;
  if (functions->start) functions->start();
  for (int frame = 0; frame < count; ++frame) {
    if (key_count && functions->command) functions->command(keys[(size_t)frame % key_count]);
    if (functions->step) functions->step(0);
  }
  if (functions->stop) functions->stop();
}

#define NOTHING(name, ...) \
  void name(__VA_ARGS__) {}
NOTHING(dsSetViewpoint, float position[3], float angles[3])
NOTHING(dsSetTexture, int texture)
NOTHING(dsSetColor, float red, float green, float blue)
NOTHING(dsSetColorAlpha, float red, float green, float blue, float alpha)

/* Everything that is drawn comes as float and, with a D behind its name, as double. */
#define DRAWN(suffix, number)                                                                   \
  NOTHING(dsDrawBox##suffix, const number p[3], const number R[12], const number sides[3])      \
  NOTHING(dsDrawSphere##suffix, const number p[3], const number R[12], float radius)            \
  NOTHING(dsDrawCylinder##suffix, const number p[3], const number R[12], float length, float r) \
  NOTHING(dsDrawCapsule##suffix, const number p[3], const number R[12], float length, float r)  \
  NOTHING(dsDrawTriangle##suffix, const number p[3], const number R[12], const number* a,       \
          const number* b, const number* c, int solid)                                          \
  NOTHING(dsDrawConvex##suffix, const number p[3], const number R[12], const number* planes,    \
          unsigned int plane_count, const number* points, unsigned int point_count,             \
          const unsigned int* polygons)
DRAWN(, float)
DRAWN(D, double)
