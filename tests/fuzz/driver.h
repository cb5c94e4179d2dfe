// Drives the C API of ODE and of this library with whatever somebody decides, and compares every
// collide with the oracle.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "../support/configurations.h"
#include "../support/contact_scene.h"
#include "../support/events_oracle.h"
#include "../support/floating_point.h"
#include "../support/oracle.h"
#include "../support/overlap_oracle.h"
#include "../support/rules_oracle.h"
#include "../support/user_box.h"
#include "decisions.h"

namespace sap_test {

// Where ODE's colliders compute with numbers: infinities make them abort, and so does a capsule
// without a radius that lies along a face of a box. Cylinders and meshes are for rays, and for
// contacts/narrow_test.cpp.
bool isTame(dGeomID geom, bool for_rays = false);

class Driver {
 public:
  // Scenes of up to `most_geoms`, on spaces of one configuration, or of any where it is null. ODE's
  // messages are silenced; an assertion of ODE's ends the program, as it would in any other.
  // `makes_tests`: user classes have AABBTest functions at times.
  Driver(Decisions& decisions, std::size_t most_geoms, const Configuration* configuration = nullptr,
         bool makes_tests = true);
  ~Driver();
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  // Makes one edit of the world, or a few frames of edits and collides, unless it is not to
  // collide.
  void step(bool collides = true);
  // Collides every space.
  void finish();

  // What was wrong first, with the calls before it; empty so far if nothing was.
  const std::string& problem() const { return problem_; }
  unsigned long collides() const { return collides_; }  // compared with the oracle
  unsigned long changes() const { return changes_; }    // of single geoms, bodies, settings
  // Frames on the CPU in which nearly all moved by little, and those of them found from kept
  // candidates.
  unsigned long trembling() const { return trembling_; }
  unsigned long candidatesKept() const { return candidates_kept_; }
  unsigned long touches() const { return touches_; }  // followed by the oracle

  // Calls of spaces, whose callbacks edit the world, call, and throw. With `jumps` they are left by
  // longjmp, too. ODE lets go of no such space, so its geoms stay to the end of the program, and
  // nothing but such calls may follow.
  void playEditedCalls(Random& random, int calls, bool jumps);

  // The first space, for tests that collide it by themselves.
  dSpaceID space() const { return spaceOf(0); }
  // Its geoms in the order of adding.
  std::vector<dGeomID> order() const { return membersOf(0); }
  std::size_t alive() const { return alive_.size(); }  // geoms, spaces apart

 protected:
  void populate();
  void createSpace();
  Pairs pairsByStay(const Pairs& got) const;
  void addGeoms(int space, bool deep, EventsOracle::Geoms& geoms) const;
  bool changes_users_unasked_ = true;  // geoms of user classes, without a word
  bool sweeps_ = true;                 // spaces get swept bounds

 private:
  static constexpr int kNone = -1;
  static constexpr std::size_t kMostSpaces = 8;
  enum Setting : std::size_t {
    kSkipStatic = 4,
    kSkipAsleep,
    kNotified,
    kSweptBounds = 9,
    kSettings
  };
  enum Kind { kBox, kSphere, kCapsule, kCylinder, kUser, kMesh, kRay, kPlane, kLeafKinds, kSpace };

  // A geom or a space; its place in objects_ is its number.
  struct Object {
    Kind kind;
    dGeomID geom;
    int parent = kNone;
    int body = kNone;
    // Spaces only.
    bool ours = false;
    bool cleans_up = true;
    std::vector<int> members;  // in the order of adding
    std::size_t stay = 0;      // the number of the call since which spaces know it as the same
    bool left_stock = false;   // the last space that it left tells nobody of that
    std::vector<std::pair<unsigned long, int>> left;  // when, and which space
  };

  // Objects, in driver_objects.cpp.
  void createOne();
  int createSpace(bool ours, int parent);
  int createLeaf(Kind kind, Random& random);
  int createBody(int at_object);
  void add(int object, int space);
  void leave(int object);
  void remove(int object);
  void addAgain(int object);
  void destroy(int object);
  void forget(int object);
  void markMoved(int object);
  void changeTriangles(int object, std::size_t place);
  void announceMeshes();
  void place(int object, std::size_t how, Random& random);
  static dReal extremeNumber(Random& random);
  static dReal randomLength(Random& random);
  static Bounds randomBounds(Random& random);

  // What may happen to a geom, in one of several ways; in driver_edits.cpp.
  struct Change {
    const char* name;
    std::size_t ways;
    void (Driver::*make)(int object, std::size_t way, Random& random);
  };
  static constexpr std::size_t kNumChanges = 13;
  static const Change kChanges[kNumChanges];
  void destroyLeaf(int object, std::size_t, Random&);
  void replaceLeaf(int object, std::size_t, Random& random);
  void leaveAndReturn(int object, std::size_t, Random&);
  void turn(int object, std::size_t, Random& random);
  void resize(int object, std::size_t, Random& random);
  void giveBody(int object, std::size_t way, Random& random);
  void push(int object, std::size_t, Random& random);
  void changeOffset(int object, std::size_t way, Random& random);
  void changeBits(int object, std::size_t way, Random& random);
  void changeEnabled(int object, std::size_t way, Random& random);
  void lookAt(int object, std::size_t, Random&);
  void changeUnasked(int object, std::size_t, Random& random);
  void tell(int object) const;
  void tellOfAll() const;
  void changeSome(const Change& change);
  void changeAnyhow(int object, Random& random);

  // Other edits, there too.
  void destroySpace();
  void moveFar();
  void changeBodies();
  void destroyBodies();
  void moveToOtherSpace();
  void cleanSpace();
  void changeSettings();
  void change(int space, std::size_t setting, std::size_t value);
  void stepWorld();
  void stepBodies(double part, double speed, Random& random);

  // Collides, in driver_collides.cpp.
  void collidePlain(int space, dGeomID with = nullptr);
  void collideTakingApart(int space);
  void collideWithGeom();
  void collideWithMany();
  void collideAnyhow();
  // `last`: it is the last collide of the space.
  void compare(int space, const Pairs& got, bool last = true);
  std::vector<dGeomID> membersOf(int space) const;
  void compareTwo(int first, int second);
  void compareTwo(int first, int second, const Pairs& got);
  bool isSwept(int object) const;  // a space, or one in it
  bool boxesAreWhole(int space) const;
  void checkList(int space);
  Pairs soundOf(const Pairs& pairs) const;
  // What a geom must be to be asked about: ODE looks at nothing else of it.
  static bool mayProbe(dGeomID geom);
  Pairs expectedOfTwo(int first, int second, bool& ordered, int& asked) const;
  unsigned mode();

  // Frames in a row, in driver_frames.cpp.
  void collideFrames();
  void fill(int space, Random& random);
  void driftAll(int space, double distance);
  void trembleAll(int space, double share, double leaving, double together, Random& random);
  void changeLast(int space, Random& random);
  std::string problemOfNumbers(int space, const Pairs& got) const;
  Pairs owedPairs(int space) const;
  void checkEvents(int space, const Pairs& got, EventsOracle& oracle);

  // Callbacks that edit the world, in driver_editing.cpp.
  class Editing;
  void collideEditing();

  // Pairs in bulk, in driver_bulk.cpp.
  void collideBlocks();

  // Rays and probes, in driver_queries.cpp.
  void askBatches();
  template <class Batch>
  void askBatch();

  // The narrow phase, in driver_contacts.cpp.
  void collideContacts();
  void collideTouching(int space, EventsOracle& oracle, Random& random);
  Pairs ownPairs(int space, const Pairs& pairs, const Pairs& with_spaces) const;
  Contacts expectedContacts(const Pairs& pairs, const SerialLoop& how, bool descends) const;

  dSpaceID spaceOf(int object) const { return reinterpret_cast<dSpaceID>(objects_[object].geom); }
  int pickSpace();
  int pickOurSpace();
  int pickMember(int space, Random& random) const;
  // Some of a space's members: one of them, or a part between a thousandth and all.
  std::vector<int> pickSome(int space, Random& random);
  bool isInside(int object, int space) const;
  std::vector<int> within(int space) const;  // at any depth
  double side() const;
  void log(const std::string& call);
  void fail(const std::string& what);

  Decisions& decisions_;
  const std::size_t most_geoms_;
  const Configuration* const configuration_;
  const bool makes_tests_;
  dMessageFunction *const messages_, *const debugs_, *const errors_;  // ODE's handlers before
  dWorldID world_;
  std::vector<Object> objects_;
  std::vector<int> alive_;   // leaves
  std::vector<int> spaces_;  // alive ones
  std::vector<dBodyID> bodies_;
  std::vector<int> changed_meshes_;  // of which nobody knows
  std::deque<std::string> history_;
  std::string problem_;
  unsigned long collides_ = 0, changes_ = 0, calls_ = 0, trembling_ = 0, candidates_kept_ = 0,
                touches_ = 0;
  std::size_t additions_ = 0;
  unsigned long time_ = 0;   // in calls, and geoms that have left spaces
  std::vector<int> locked_;  // spaces that were left by longjmp
};

}  // namespace sap_test
