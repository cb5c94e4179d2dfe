// exit-program WAY: ends with spaces that collided. tests/lifecycle/at_exit.sh runs it.
#include <ode/ode.h>
#include <ode_parallel_sap/parallel_sap_space.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#if !defined(_WIN32)
#include <sys/wait.h>
#include <unistd.h>
#endif

namespace {

long pairs_left = -1;  // before it exits in a callback

void near(void*, dGeomID, dGeomID) {
  if (pairs_left-- == 0) std::exit(0);
}

dSpaceID makeSpace() {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  for (int i = 0; i < 300; ++i) dGeomSetPosition(dCreateSphere(space, dReal(0.6)), dReal(i), 0, 0);
  return space;
}

void collide(dSpaceID space) {
  for (int frame = 0; frame < 10; ++frame) dSpaceCollide(space, nullptr, near);
}

// Ends after what was registered when the first space was made.
struct Late {
  dSpaceID space = nullptr;
  ~Late() {
    if (space) dSpaceDestroy(space);
  }
} late;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string way = argv[1];
  dInitODE2(0);
  const dSpaceID space = makeSpace();
  // A program's handler may use what is gone then.
  if (way == "handler") dSetMessageHandler([](int, const char*, va_list) { std::abort(); });
  if (way == "callback") pairs_left = 9 * 299;  // in the tenth frame
  if (way == "thread")
    std::thread([space] { collide(space); }).join();
  else
    collide(space);
  if (way == "destroyed") dSpaceDestroy(space);
  if (way == "late") late.space = space;
  if (way == "closed") dCloseODE();
#if !defined(_WIN32)
  if (way == "fork") {
    const pid_t child = fork();
    if (child == 0) std::exit(0);
    waitpid(child, nullptr, 0);
  }
#endif
  if (way == "busy") {  // while another thread collides
    std::thread([space] {
      for (;;) collide(space);
    }).detach();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}
