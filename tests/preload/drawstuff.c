/* A drawstuff without a window, for ODE's demos: runs a number of frames and presses keys.
 *
 *     DRAWSTUFF_FRAMES=200 DRAWSTUFF_KEYS=bsc demo_boxstack
 *
 * One key a frame, again from the first after the last. Keys and frames are all a demo sees; what
 * it draws goes nowhere. */
#include <drawstuff/drawstuff.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int stopped = 0;
static float viewpoint[6] = {2, 0, 1, 180, 0, 0};

void dsSimulationLoop(int argc, char** argv, int width, int height, dsFunctions* functions) {
  const char* const frames = getenv("DRAWSTUFF_FRAMES");
  const char* const keys = getenv("DRAWSTUFF_KEYS");
  const int count = frames ? atoi(frames) : 100;
  const size_t key_count = keys ? strlen(keys) : 0;
  (void)argc, (void)argv, (void)width, (void)height;
  if (functions->start) functions->start();
  for (int frame = 0; frame < count && !stopped; ++frame) {
    if (key_count && functions->command) functions->command(keys[(size_t)frame % key_count]);
    if (functions->step) functions->step(0);
  }
  if (functions->stop) functions->stop();
}

void dsStop(void) {
  stopped = 1;
}

/* Demos scale what they do by the time since the last frame: always the same here. */
double dsElapsedTime(void) {
  return 1.0 / 60;
}

static void say(const char* kind, const char* message, va_list arguments) {
  fprintf(stderr, "%s", kind);
  vfprintf(stderr, message, arguments);
  fprintf(stderr, "\n");
}

void dsError(const char* message, ...) {
  va_list arguments;
  va_start(arguments, message);
  say("drawstuff error: ", message, arguments);
  exit(1);
}

void dsDebug(const char* message, ...) {
  va_list arguments;
  va_start(arguments, message);
  say("drawstuff bug: ", message, arguments);
  abort();
}

void dsPrint(const char* message, ...) {
  va_list arguments;
  va_start(arguments, message);
  vprintf(message, arguments);
  va_end(arguments);
}

void dsSetViewpoint(float position[3], float angles[3]) {
  if (position) memcpy(viewpoint, position, 3 * sizeof(float));
  if (angles) memcpy(viewpoint + 3, angles, 3 * sizeof(float));
}

void dsGetViewpoint(float position[3], float angles[3]) {
  if (position) memcpy(position, viewpoint, 3 * sizeof(float));
  if (angles) memcpy(angles, viewpoint + 3, 3 * sizeof(float));
}

#pragma GCC diagnostic ignored "-Wunused-parameter"
#define NOTHING(name, ...) \
  void name(__VA_ARGS__) {}
/* Everything that is drawn comes as float and, with a D behind its name, as double. */
#define FLOAT_AND_DOUBLE(name, ...)                               \
  NOTHING(name, const float p[3], const float R[12], __VA_ARGS__) \
  NOTHING(name##D, const double p[3], const double R[12], __VA_ARGS__)

NOTHING(dsSetTexture, int texture)
NOTHING(dsSetColor, float red, float green, float blue)
NOTHING(dsSetColorAlpha, float red, float green, float blue, float alpha)
NOTHING(dsSetSphereQuality, int n)
NOTHING(dsSetCapsuleQuality, int n)
NOTHING(dsSetDrawMode, int mode)
FLOAT_AND_DOUBLE(dsDrawSphere, float radius)
FLOAT_AND_DOUBLE(dsDrawCylinder, float length, float radius)
FLOAT_AND_DOUBLE(dsDrawCapsule, float length, float radius)

#define SHAPES(name, number)                                                               \
  NOTHING(name(dsDrawBox), const number p[3], const number R[12], const number sides[3])   \
  NOTHING(name(dsDrawTriangle), const number p[3], const number R[12], const number* a,    \
          const number* b, const number* c, int solid)                                     \
  NOTHING(name(dsDrawTriangles), const number p[3], const number R[12], const number* v,   \
          const int n, int solid)                                                          \
  NOTHING(name(dsDrawConvex), const number p[3], const number R[12], const number* planes, \
          unsigned int plane_count, const number* points, unsigned int point_count,        \
          const unsigned int* polygons)                                                    \
  NOTHING(name(dsDrawLine), const number a[3], const number b[3])
#define FLOAT(name) name
#define DOUBLE(name) name##D
SHAPES(FLOAT, float)
SHAPES(DOUBLE, double)
