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
#include <random>
#include <string>
#include <thread>
#include <tuple>
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

dReal uniform(double from, double to) {
  static std::mt19937 engine(1);
  return static_cast<dReal>(from + (to - from) * (static_cast<double>(engine()) / 4294967296.0));
}

std::size_t numberOf(dGeomID geom) {
  return reinterpret_cast<std::size_t>(dGeomGetData(geom));
}

// Pointers are not the same in two runs. All else of a contact is, and what lies between two.
std::uint64_t hashOf(dContact* contacts, int n) {
  std::uint64_t hash = 14695981039346656037u;
  for (int i = 0; i < n; ++i) {
    dContactGeom& geom = contacts[i].geom;
    geom.g1 = reinterpret_cast<dGeomID>(numberOf(geom.g1));
    geom.g2 = reinterpret_cast<dGeomID>(numberOf(geom.g2));
    const auto* const bytes = reinterpret_cast<const unsigned char*>(&contacts[i]);
    for (std::size_t byte = 0; byte < sizeof contacts[i]; ++byte)
      hash = (hash ^ bytes[byte]) * 1099511628211u;
  }
  return hash;
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
  const dReal round[] = {uniform(0.2, 0.4), uniform(0.3, 0.9)};
  if (kind == 1) return dCreateCapsule(space, round[0], round[1]);
  if (kind == 2) return dCreateCylinder(space, round[0], round[1]);
  const dReal size[] = {uniform(0.4, 1), uniform(0.4, 1), uniform(0.4, 1)};
  return dCreateBox(space, size[0], size[1], size[2]);
}

class Program {
 public:
  Program(const char* scenario, int frames) : scenario_(scenario), frames_(frames) {
    number(dCreatePlane(space_, 0, 0, 1, 20.5));
    for (int i = 0; i < count; ++i) {
      const dGeomID geom = number(i % 50 == 49 ? dCreateRay(space_, 3) : makeShape(space_, i % 5));
      if (i % 3) {
        bodies_.push_back(dBodyCreate(world_));
        dGeomSetBody(geom, bodies_.back());
      }
      place(geom);
      if (i % 12 == 1) dGeomSetOffsetPosition(geom, 0.1, 0.2, 0.1);
      if (i % 9 == 0) dGeomSetBody(makeShape(nullptr, 0), bodies_.empty() ? nullptr : bodies_[0]);
    }
    // Two geoms of one body, which are no pair while they are that.
    for (int i = 0; i < 20; ++i) {
      const dGeomID geom = number(dCreateBox(space_, 1, 1, 1));
      dGeomSetBody(geom, bodies_[static_cast<std::size_t>(i / 2)]);
      dGeomSetOffsetPosition(geom, static_cast<dReal>(0.1 * i), 0, 0);
    }
  }

  // 1 where a forked child, whose prints come first, ended otherwise than it should; one that hangs
  // is killed.
  int run() {
    bool is_child = false;
    for (frame_ = 0; frame_ < frames_; ++frame_) {
      if (is("fork") && frame_ % 3 == 2) {
        std::fflush(stdout);
        const pid_t child = fork();
        int status = 1;
        if (child == 0) {
          is_child = true;
          alarm(60);
        } else if (child < 0 || waitpid(child, &status, 0) != child || status != 0) {
          return 1;
        }
      }
      try {
        calls_ = 0;
        is("destroy") ? runCouples() : dSpaceCollide(space_, this, near);
        flush();
      } catch (int frame) {
        std::printf("thrown in frame %d\n", frame);
      }
      std::fesetround(FE_TONEAREST);
      print();
      for (const dBodyID body : bodies_) {
        const dReal* const at = dBodyGetPosition(body);
        dBodySetPosition(body, at[0] + uniform(-0.1, 0.1), at[1], at[2]);
      }
      for (const dGeomID geom : geoms_)
        if (!is("destroy")) dGeomEnable(geom);
    }
    std::fflush(stdout);
    if (is_child) _exit(0);
    return 0;
  }

 private:
  bool is(const char* name) const { return scenario_ == name; }

  dGeomID number(dGeomID geom) {
    dGeomSetData(geom, reinterpret_cast<void*>(geoms_.size()));
    geoms_.push_back(geom);
    return geom;
  }

  void collide(dGeomID a, dGeomID b, int flags = most_contacts) {
    dContact contacts[most_contacts];
    std::memset(static_cast<void*>(contacts), 0xab, sizeof contacts);
    const int n = dCollide(a, b, flags, &contacts[0].geom, sizeof contacts[0]);
    lines_.emplace_back(numberOf(a), numberOf(b), hashOf(contacts, n), n);
  }

  void print() {
    std::sort(lines_.begin(), lines_.end());
    for (const auto& [a, b, hash, n] : lines_)
      std::printf("%d: %zu-%zu %d %016llx\n", frame_, a, b, n,
                  static_cast<unsigned long long>(hash));
    lines_.clear();
  }

  int flagsFor(dGeomID a) const {
    if (is("flags-by-pair")) return 1 + static_cast<int>(numberOf(a) % most_contacts);
    if (is("classes") && dGeomGetClass(a) == dBoxClass) return 2;
    if (is("flags-by-frame")) return 1 + frame_ % most_contacts;
    return most_contacts;
  }

  // What the callback changes before it collides the pair, by the scenario.
  void change(dGeomID a, dGeomID b) {
    const Unlocked unlocked(space_);
    const dGeomID movable = dGeomGetClass(a) == dPlaneClass ? b : a;
    if (is("move")) {
      const dReal* const at = dGeomGetPosition(movable);
      dGeomSetPosition(movable, at[0] + dReal(0.01), at[1], at[2]);
    } else if (is("move-and-clean")) {
      const dReal* const at = dGeomGetPosition(b);
      dGeomSetPosition(b, at[0], at[1] + dReal(0.01), at[2]);
      dSpaceClean(space_);
    } else if (is("move-body") && dGeomGetBody(b)) {
      const dReal* const at = dBodyGetPosition(dGeomGetBody(b));
      dBodySetPosition(dGeomGetBody(b), at[0], at[1], at[2] - dReal(0.01));
    } else if (is("resize") && dGeomGetClass(a) == dBoxClass) {
      dGeomBoxSetLengths(a, dReal(0.8), dReal(0.8), dReal(0.8));
    } else if (is("take-body") && dGeomGetBody(a)) {
      dGeomSetBody(a, nullptr);
    } else if (is("give-body") && dGeomGetClass(a) != dPlaneClass) {
      dGeomSetBody(a, dGeomGetBody(b));
    } else if (is("disable")) {
      dGeomDisable(a);
    } else if (is("bits")) {
      dGeomSetCategoryBits(a, 0);
      dGeomSetData(a, dGeomGetData(a));
    } else if (is("override")) {
      dSetColliderOverride(dBoxClass, dBoxClass, never);
    }
  }

  void flush() {
    for (const auto& [a, b] : gathered_) collide(a, b);
    gathered_.clear();
  }

  void collideAgain(dGeomID a, dGeomID b) {
    ++depth_;
    if (calls_ % 64 == 1) dSpaceCollide(space_, this, near);
    if (calls_ % 8 == 2) dSpaceCollide2(a, reinterpret_cast<dGeomID>(space_), this, near);
    if (calls_ % 8 == 3) dSpaceCollide(others_, this, near);
    collide(a, b);
    collide(a, geoms_[geoms_.size() / 2]);
    --depth_;
  }

  void meet(dGeomID a, dGeomID b) {
    ++calls_;
    if (numberOf(a) > numberOf(b)) std::swap(a, b);
    if (is("some") && numberOf(a) % 4) return;
    if (is("bodies") && !(dGeomGetBody(a) && dGeomGetBody(b))) return;
    if (is("gone") && frame_ % 20 != 1) return;
    if (is("gather")) {
      if (numberOf(a) % 5) gathered_.push_back({a, b});
      if (gathered_.size() == 32) flush();
      return;
    }
    if (is("again") && depth_ == 0) return collideAgain(a, b);
    const int flags = flagsFor(a);
    if (is("threads") && calls_ % 16 == 0) return std::thread([&] { collide(a, b, flags); }).join();
    if (is("rounding")) std::fesetround(calls_ % 2 ? FE_UPWARD : FE_TONEAREST);
    if (frame_ > 3 && calls_ % 3 == 0) change(a, b);
    if (is("swap") && calls_ % 2) std::swap(a, b);
    collide(a, b, flags);
    if (is("twice")) collide(a, b, flags);
    if (is("throw") && calls_ % 100 == 0) throw frame_;
  }
  static void near(void* data, dGeomID a, dGeomID b) { static_cast<Program*>(data)->meet(a, b); }

  // Geoms past the scene's, which are in one pair each. One that no later pair names makes room for
  // another.
  void runCouples() {
    space_ = dHashSpaceCreate(nullptr);
    for (int i = 0; i < 300; ++i)
      dGeomSetPosition(number(dCreateSphere(space_, 0.5)),
                       static_cast<dReal>(20 + 2 * (i / 2) + 0.7 * (i % 2)), 20, 20);
    const auto couple = [](void* data, dGeomID a, dGeomID b) {
      Program& self = *static_cast<Program*>(data);
      if (numberOf(a) > numberOf(b)) std::swap(a, b);
      self.collide(a, b);
      if (self.frame_ <= 3 || numberOf(a) % 10) return;
      const Unlocked unlocked(self.space_);
      void* const old = dGeomGetData(a);
      dGeomDestroy(a);
      const dGeomID now = dCreateSphere(nullptr, 0.5);
      dGeomSetData(now, old);
      const dReal* const at = dGeomGetPosition(b);
      dGeomSetPosition(now, at[0] + dReal(0.2), at[1], at[2]);
      self.collide(now, b);
      dGeomDestroy(now);
    };
    for (frame_ = 0; frame_ < frames_; ++frame_) dSpaceCollide(space_, this, couple);
  }

  const std::string scenario_;
  const int frames_;
  const dWorldID world_ = dWorldCreate();
  dSpaceID space_ = dHashSpaceCreate(nullptr);
  const dSpaceID others_ = dSimpleSpaceCreate(nullptr);
  std::vector<dBodyID> bodies_;
  std::vector<dGeomID> geoms_;
  std::vector<std::tuple<std::size_t, std::size_t, std::uint64_t, int>> lines_;
  std::vector<std::pair<dGeomID, dGeomID>> gathered_;
  int frame_ = 0, calls_ = 0, depth_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  dInitODE2(0);
  return Program(argc > 1 ? argv[1] : "plain", argc > 2 ? std::atoi(argv[2]) : 8).run();
}
