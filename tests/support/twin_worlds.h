// The same random calls on three worlds: one with our spaces (some of them inside stock spaces,
// some around them), one with dSimpleSpaces, one with dHashSpaces.
#pragma once

#include <ode/ode.h>

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "configurations.h"
#include "random.h"
#include "recorder.h"

namespace sap_test {

class TwinWorlds {
 public:
  // Starts with `geoms` geoms. Our spaces take their settings from `configuration`.
  TwinWorlds(std::uint64_t seed, const Configuration& configuration, int geoms);
  ~TwinWorlds();
  TwinWorlds(const TwinWorlds&) = delete;
  TwinWorlds& operator=(const TwinWorlds&) = delete;

  // One random call (or a few that belong together) on every world.
  void edit();

  // Compares whatever the worlds let one see: "" or what is wrong first.
  std::string check();

  // The last calls, one a line.
  std::string history() const;

 private:
  enum World { kOurs, kSimple, kHash, kWorlds };
  enum Kind { kSphere, kBox, kCapsule, kCylinder, kRay, kUser, kPlane, kLeafKinds, kSpace };
  static constexpr int kNone = -1;

  // A geom or a space of all three worlds. Its place in objects_ is its number for ever.
  struct Object {
    Kind kind;
    bool alive = true;
    std::array<dGeomID, kWorlds> in = {};
    int parent = kNone;
    int body = kNone;
    bool offset = false;
    std::array<dReal, 4> plane = {};
    // Spaces only: who makes it in the first world, and its contents in the order of adding.
    bool ours = false;
    bool cleans_up = true;
    std::vector<int> members;
  };
  struct Body {
    bool alive = true;
    std::array<dBodyID, kWorlds> in = {};
  };

  // Objects and bodies, in twin_worlds.cpp.
  void log(const std::string& call);
  dReal coordinate();
  dReal height();
  dReal size();
  int pick(bool (*wanted)(const Object&));  // kNone if there is none
  int pickBody();
  bool isInside(int object, int space) const;
  dSpaceID space(int object, int world) const;
  bool isStock(int space, int world) const;

  static dGeomID makeLeaf(const Object& object, dReal a, dReal b, dReal c);
  int createLeaf();
  int createSpace();
  void createSpaceInside();
  int createBody();
  void add(int object, int space);
  void remove(int object);
  void destroy(int object);
  void forget(int object);
  void makeDirty(int object, int world);

  // Edits, in twin_worlds_edits.cpp.
  void replaceLeaf();
  void removeSomething();
  void switchSomething();
  void moveSomething();
  void turnSomething();
  void changeBody();
  void changeOffset();
  void changeBits();
  void changeSize();
  void destroyBody();
  void reAdd();
  void moveBetweenSpaces();
  void changeSpaceSettings();
  void onlyLook();

  // Comparisons, in twin_worlds_checks.cpp.
  std::string checkEnumeration(int space);
  std::string checkPairs(int space);
  std::string checkAllTheWayDown(int space);
  std::string checkCollide2();

  Random random_;
  Configuration configuration_;
  std::array<dWorldID, kWorlds> dynamics_;
  std::vector<Object> objects_;
  std::vector<Body> bodies_;
  std::deque<std::string> history_;
  unsigned long calls_ = 0;
};

}  // namespace sap_test
