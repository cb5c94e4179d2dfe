// collide_program SCENARIO [FRAMES]
//
// A program that knows ODE only, whose near callback collides each pair of a scene of spheres,
// boxes, capsules, cylinders, planes and some others, and prints what came of it, to the last bit.
// What else the callback does is the scenario. With and without the preload library, and whatever
// that finds beforehand, the prints are the same. (Scenarios that depend on the order of the pairs
// are run under the preload library only.)
#include <dlfcn.h>
#include <ode/ode.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cfenv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "space/geoms/ode_private.h"

// In the place of ODE's: the space, too, is to take it for one without assertions (see Unlocked).
int dCheckConfiguration(const char* token) {
  static const auto of_ode =
      reinterpret_cast<int (*)(const char*)>(dlsym(RTLD_NEXT, "dCheckConfiguration"));
  return std::strcmp(token, "ODE_EXT_no_debug") == 0 || of_ode(token);
}

namespace {

// In an ODE that is built without assertions a callback may do anything to the geoms of the space.
// This makes it so in every ODE while it lives.
class Unlocked {
 public:
  explicit Unlocked(dSpaceID space) : space_(space), locks_(space->lock_count) {
    space_->lock_count = 0;
  }
  ~Unlocked() { space_->lock_count = locks_; }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  dSpaceID space_;
  int locks_;
};

constexpr int most_contacts = 12;
constexpr int count = 400;

std::uint32_t random_state = 1;
dReal uniform(dReal from, dReal to) {
  random_state = random_state * 1664525u + 1013904223u;
  return from + (to - from) * static_cast<dReal>(random_state >> 8) / static_cast<dReal>(1 << 24);
}

struct Line {
  std::size_t a, b;
  int count;
  std::uint64_t hash;
  bool operator<(const Line& other) const {
    return a != other.a ? a < other.a : b != other.b ? b < other.b : hash < other.hash;
  }
};

struct Program {
  std::string scenario;
  dWorldID world = nullptr;
  dSpaceID space = nullptr, others = nullptr;
  std::vector<dBodyID> bodies;
  std::vector<dGeomID> geoms;
  std::vector<Line> lines;
  std::vector<std::pair<dGeomID, dGeomID>> gathered;
  int frames = 8, frame = 0, calls = 0, depth = 0;

  bool is(const char* name) const { return scenario == name; }
};

std::size_t numberOf(dGeomID geom) {
  return reinterpret_cast<std::size_t>(dGeomGetData(geom));
}

std::uint64_t hashOf(const void* data, std::size_t size, std::uint64_t hash) {
  for (const unsigned char* byte = static_cast<const unsigned char*>(data); size; --size, ++byte)
    hash = (hash ^ *byte) * 1099511628211u;
  return hash;
}

// Pointers are not the same in two runs. All else of a contact is, and what lies between two.
std::uint64_t hashOf(dContact* contacts, int count) {
  std::uint64_t hash = 14695981039346656037u;
  for (int i = 0; i < count; ++i) {
    dContactGeom& geom = contacts[i].geom;
    const std::size_t numbers[] = {numberOf(geom.g1), numberOf(geom.g2)};
    geom.g1 = geom.g2 = nullptr;
    hash = hashOf(numbers, sizeof numbers, hash);
    hash = hashOf(&contacts[i], sizeof contacts[i], hash);
  }
  return hash;
}

void collide(Program& program, dGeomID a, dGeomID b, int flags) {
  dContact contacts[most_contacts];
  std::memset(static_cast<void*>(contacts), 0xab, sizeof contacts);
  const int count = dCollide(a, b, flags, &contacts[0].geom, sizeof contacts[0]);
  program.lines.push_back({numberOf(a), numberOf(b), count, hashOf(contacts, count)});
}

int flagsFor(const Program& program, dGeomID a) {
  if (program.is("flags-by-pair")) return 1 + static_cast<int>(numberOf(a) % most_contacts);
  if (program.is("classes") && dGeomGetClass(a) == dBoxClass) return 2;
  if (program.is("flags-by-frame")) return 1 + program.frame % most_contacts;
  return most_contacts;
}

int never(dGeomID, dGeomID, int, dContactGeom*, int) {
  return 0;
}

// Numbers are drawn in a list in braces or one by one: compilers differ in the order of arguments.
void place(dGeomID geom) {
  const dReal turn[] = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(0, 6)};
  dMatrix3 rotation;
  dRFromAxisAndAngle(rotation, turn[0], turn[1], turn[2], turn[3]);
  dGeomSetRotation(geom, rotation);
  const dReal at[] = {uniform(20, 27), uniform(20, 27), uniform(20, 26)};
  dGeomSetPosition(geom, at[0], at[1], at[2]);
}

dGeomID makeShape(dSpaceID space, int kind) {
  if (kind == 0) return dCreateSphere(space, uniform(0.3, 0.6));
  if (kind == 1) {
    const dReal size[] = {uniform(0.2, 0.4), uniform(0.3, 0.9)};
    return dCreateCapsule(space, size[0], size[1]);
  }
  if (kind == 2) {
    const dReal size[] = {uniform(0.2, 0.5), uniform(0.3, 0.9)};
    return dCreateCylinder(space, size[0], size[1]);
  }
  const dReal size[] = {uniform(0.4, 1), uniform(0.4, 1), uniform(0.4, 1)};
  return dCreateBox(space, size[0], size[1], size[2]);
}

void number(Program& program, dGeomID geom) {
  dGeomSetData(geom, reinterpret_cast<void*>(program.geoms.size()));
  program.geoms.push_back(geom);
}

void makeScene(Program& program) {
  program.world = dWorldCreate();
  program.space = dHashSpaceCreate(nullptr);
  program.others = dSimpleSpaceCreate(nullptr);
  number(program, dCreatePlane(program.space, 0, 0, 1, 20.5));
  for (int i = 0; i < count; ++i) {
    const dGeomID geom =
        i % 50 == 49 ? dCreateRay(program.space, 3) : makeShape(program.space, i % 5);
    number(program, geom);
    if (i % 3) {
      program.bodies.push_back(dBodyCreate(program.world));
      dGeomSetBody(geom, program.bodies.back());
    }
    place(geom);
    if (i % 12 == 1) dGeomSetOffsetPosition(geom, 0.1, 0.2, 0.1);
    if (i % 9 == 0)
      dGeomSetBody(makeShape(nullptr, 0), program.bodies.empty() ? nullptr : program.bodies[0]);
  }
  // Two geoms of one body, which are no pair while they are that.
  for (int i = 0; i < 20; ++i) {
    const dGeomID geom = dCreateBox(program.space, 1, 1, 1);
    number(program, geom);
    dGeomSetBody(geom, program.bodies[static_cast<std::size_t>(i / 2)]);
    dGeomSetOffsetPosition(geom, 0.1 * i, 0, 0);
  }
}

// What the callback changes before it collides the pair, by the scenario.
void change(Program& program, dGeomID a, dGeomID b) {
  const Unlocked unlocked(program.space);
  const dGeomID movable = dGeomGetClass(a) == dPlaneClass ? b : a;
  if (program.is("move")) {
    const dReal* const at = dGeomGetPosition(movable);
    dGeomSetPosition(movable, at[0] + 0.01, at[1], at[2]);
  } else if (program.is("move-and-clean")) {
    const dReal* const at = dGeomGetPosition(b);
    dGeomSetPosition(b, at[0], at[1] + 0.01, at[2]);
    dSpaceClean(program.space);
  } else if (program.is("move-body") && dGeomGetBody(b)) {
    const dReal* const at = dBodyGetPosition(dGeomGetBody(b));
    dBodySetPosition(dGeomGetBody(b), at[0], at[1], at[2] - 0.01);
  } else if (program.is("resize") && dGeomGetClass(a) == dBoxClass) {
    dGeomBoxSetLengths(a, 0.8, 0.8, 0.8);
  } else if (program.is("take-body") && dGeomGetBody(a)) {
    dGeomSetBody(a, nullptr);
  } else if (program.is("give-body") && dGeomGetClass(a) != dPlaneClass) {
    dGeomSetBody(a, dGeomGetBody(b));
  } else if (program.is("disable")) {
    dGeomDisable(a);
  } else if (program.is("bits")) {
    dGeomSetCategoryBits(a, 0);
    dGeomSetData(a, dGeomGetData(a));
  } else if (program.is("override")) {
    dSetColliderOverride(dBoxClass, dBoxClass, never);
  }
}

// A geom that no later pair names makes room for another.
void replace(Program& program, dGeomID a, dGeomID b) {
  const Unlocked unlocked(program.space);
  const std::size_t old = numberOf(a);
  dGeomDestroy(a);
  const dGeomID now = dCreateSphere(nullptr, 0.5);
  dGeomSetData(now, reinterpret_cast<void*>(old));
  const dReal* const at = dGeomGetPosition(b);
  dGeomSetPosition(now, at[0] + 0.2, at[1], at[2]);
  collide(program, now, b, most_contacts);
  dGeomDestroy(now);
}

void flush(Program& program) {
  for (const auto& pair : program.gathered)
    collide(program, pair.first, pair.second, most_contacts);
  program.gathered.clear();
}

void near(void* data, dGeomID a, dGeomID b);

void collideAgain(Program& program, dGeomID a, dGeomID b) {
  ++program.depth;
  if (program.calls % 64 == 1) dSpaceCollide(program.space, &program, near);
  if (program.calls % 8 == 2)
    dSpaceCollide2(a, reinterpret_cast<dGeomID>(program.space), &program, near);
  if (program.calls % 8 == 3) dSpaceCollide(program.others, &program, near);
  collide(program, a, b, most_contacts);
  collide(program, a, program.geoms[program.geoms.size() / 2], most_contacts);
  --program.depth;
}

void near(void* data, dGeomID a, dGeomID b) {
  Program& program = *static_cast<Program*>(data);
  ++program.calls;
  if (numberOf(a) > numberOf(b)) std::swap(a, b);
  if (program.is("some") && numberOf(a) % 4) return;
  if (program.is("bodies") && !(dGeomGetBody(a) && dGeomGetBody(b))) return;
  if (program.is("gone") && program.frame % 20 != 1) return;
  if (program.is("gather")) {
    if (numberOf(a) % 5) program.gathered.push_back({a, b});
    if (program.gathered.size() == 32) flush(program);
    return;
  }
  if (program.is("again") && program.depth == 0) return collideAgain(program, a, b);
  const int flags = flagsFor(program, a);
  if (program.is("threads") && program.calls % 16 == 0) {
    std::thread([&] { collide(program, a, b, flags); }).join();
    return;
  }
  if (program.is("rounding")) std::fesetround(program.calls % 2 ? FE_UPWARD : FE_TONEAREST);
  if (program.frame > 3 && program.calls % 3 == 0) change(program, a, b);
  if (program.is("swap") && program.calls % 2) std::swap(a, b);
  collide(program, a, b, flags);
  if (program.is("twice")) collide(program, a, b, flags);
  if (program.is("throw") && program.calls % 100 == 0) throw program.frame;
}

// The geoms past the scene's, which are in one pair each.
void nearCouple(void* data, dGeomID a, dGeomID b) {
  Program& program = *static_cast<Program*>(data);
  if (numberOf(a) > numberOf(b)) std::swap(a, b);
  collide(program, a, b, most_contacts);
  if (program.frame > 3 && numberOf(a) % 10 == 0) replace(program, a, b);
}

void makeCouples(Program& program) {
  program.space = dHashSpaceCreate(nullptr);
  for (int i = 0; i < 300; ++i) {
    const dGeomID geom = dCreateSphere(program.space, 0.5);
    number(program, geom);
    dGeomSetPosition(geom, 20 + 2 * (i / 2) + 0.7 * (i % 2), 20, 20);
  }
}

void runFrame(Program& program) {
  program.calls = 0;
  if (program.is("destroy")) {
    makeCouples(program);
    for (program.frame = 0; program.frame < program.frames; ++program.frame)
      dSpaceCollide(program.space, &program, nearCouple);
  } else {
    dSpaceCollide(program.space, &program, near);
    flush(program);
  }
  std::fesetround(FE_TONEAREST);
}

void print(Program& program) {
  std::sort(program.lines.begin(), program.lines.end());
  for (const Line& line : program.lines)
    std::printf("%d: %zu-%zu %d %016llx\n", program.frame, line.a, line.b, line.count,
                static_cast<unsigned long long>(line.hash));
  program.lines.clear();
}

// What the child does comes first. One that hangs is killed.
bool forkAndWait(bool& is_child) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    is_child = true;
    alarm(60);
    return true;
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

}  // namespace

int main(int argc, char** argv) {
  Program program;
  program.scenario = argc > 1 ? argv[1] : "plain";
  dInitODE2(0);
  if (argc > 2) program.frames = std::atoi(argv[2]);
  bool is_child = false;
  makeScene(program);
  for (program.frame = 0; program.frame < program.frames; ++program.frame) {
    if (program.is("fork") && program.frame % 3 == 2 && !forkAndWait(is_child)) return 1;
    try {
      runFrame(program);
    } catch (int frame) {
      std::printf("thrown in frame %d\n", frame);
    }
    print(program);
    for (const dBodyID body : program.bodies) {
      const dReal* const at = dBodyGetPosition(body);
      dBodySetPosition(body, at[0] + uniform(-0.1, 0.1), at[1], at[2]);
    }
    for (const dGeomID geom : program.geoms)
      if (!program.is("destroy")) dGeomEnable(geom);
  }
  std::fflush(stdout);
  if (is_child) _exit(0);
  return 0;
}
