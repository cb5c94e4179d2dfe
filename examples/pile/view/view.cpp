#include "view.h"

#include <GL/glx.h>
#include <drawstuff/drawstuff.h>
#include <internal.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "canvas.h"
#include "offscreen.h"

// drawstuff's X11 part, under another name: dsPlatformSimLoop below chooses between it and memory.
void dsWindowSimLoop(int width, int height, dsFunctions* functions, int initial_pause);

namespace pile {
namespace {

constexpr int width = 800;
constexpr int height = 600;

void setWindowTitle(const std::string& title) {
  if (Display* display = glXGetCurrentDisplay())
    XStoreName(display, glXGetCurrentDrawable(), title.c_str());
}

class Drawstuff {
 public:
  Drawstuff(const Options& options, const Show& show) : options_(options), show_(show) {
    if (!options_.view)
      memory_.emplace(2 * width, 2 * height);
    else if (!std::getenv("DISPLAY"))
      throw UsageError("--view needs an X11 display (DISPLAY). --snapshot FILE draws without");
    if (!options_.snapshot.empty() && !std::ofstream(options_.snapshot, std::ios::app))
      throw UsageError("cannot write the file " + options_.snapshot);
    current_ = this;
  }
  ~Drawstuff() { current_ = nullptr; }

  void run() {
    if (!options_.view)
      while (show_.step()) {
      }
    functions_.version = DS_VERSION;
    functions_.start = [] { current_->start(); };
    functions_.step = [](int paused) { current_->step(paused != 0); };
    functions_.command = [](int key) { current_->command(key); };
    functions_.stop = [] { current_->stop(); };
    functions_.path_to_textures = PILE_TEXTURES;
    std::string words[] = {"pile", "-notex", "-noshadow"};
    char* arguments[] = {words[0].data(), words[1].data(), words[2].data()};
    dsSimulationLoop(hasFlatGround(show_.world) ? 2 : 3, arguments, width, height, &functions_);
  }

  // What drawstuff calls in place of its main loop.
  static void loop(int window_width, int window_height, dsFunctions* functions, int paused) {
    if (current_->options_.view)
      return dsWindowSimLoop(window_width, window_height, functions, paused);
    dsStartGraphics(2 * width, 2 * height, functions);
    functions->start();
    functions->stop();
    dsStopGraphics();
  }

 private:
  using Clock = std::chrono::steady_clock;

  void start() {
    camera_ = cameraFor(show_.world);
    canvas_.emplace(show_.world, camera_);
    aim();
    if (!options_.view) return;
    setWindowTitle(show_.title());
    std::puts(
        "a: bounding boxes; t: contacts; Ctrl-P, Ctrl-O, Ctrl-T, Ctrl-X: pause, one step, "
        "textures, end");
    std::fflush(stdout);
  }

  void step(bool paused) {
    if (options_.view && !ending_ && !paused && !show_.step()) dsStop();
    canvas_->draw(show_.simulation, layers_);
    constexpr std::chrono::milliseconds legible(250);
    if (!options_.view || Clock::now() - titled_ < legible) return;
    setWindowTitle(show_.title());
    follow();
    titled_ = Clock::now();
  }

  static std::array<float, 6> viewpoint() {
    std::array<float, 6> view;
    dsGetViewpoint(view.data(), view.data() + 3);
    return view;
  }

  void aim() {
    canvas_->aim(camera_);
    aimed_ = viewpoint();
  }

  // Keeps the bodies in the picture while they fall and spread, until the user moves the camera.
  void follow() {
    if (viewpoint() != aimed_) return;
    camera_ = cameraFor(show_.world);
    aim();
  }

  void command(int key) {
    if (key == 'a' || key == 'A') layers_.boxes ^= true;
    if (key == 't' || key == 'T') layers_.contacts ^= true;
  }

  // The end of the window or of the run: draws once more, for the picture.
  void stop() {
    ending_ = true;
    follow();
    if (!options_.snapshot.empty()) {
      GLint viewport[4] = {0, 0, 2 * width, 2 * height};
      if (options_.view) glGetIntegerv(GL_VIEWPORT, viewport);
      dsDrawFrame(viewport[2], viewport[3], &functions_, 1);
      savePicture(options_.snapshot, options_.view ? 1 : 2);
    }
    canvas_.reset();  // while OpenGL's context is there
  }

  static Drawstuff* current_;

  const Options& options_;
  const Show& show_;
  std::optional<Offscreen> memory_;
  dsFunctions functions_ = {};
  std::optional<Canvas> canvas_;
  Camera camera_ = {};
  std::array<float, 6> aimed_ = {};  // what drawstuff made of camera_
  Layers layers_;
  bool ending_ = false;
  Clock::time_point titled_;
};

Drawstuff* Drawstuff::current_ = nullptr;

}  // namespace

void view(const Options& options, const Show& show) {
  Drawstuff(options, show).run();
}

}  // namespace pile

void dsPlatformSimLoop(int width, int height, dsFunctions* functions, int paused) {
  pile::Drawstuff::loop(width, height, functions, paused);
}
