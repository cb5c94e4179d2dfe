// A heap of everything that ODE can collide, and contacts to compare.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace sap_test {

// What dCollide found for a pair.
struct Contact : dContactGeom {
  dGeomID o1, o2;
};
using Contacts = std::vector<Contact>;

// A dParallelSAPContactCallback; `contacts` points to Contacts.
void recordContacts(void* contacts, dGeomID o1, dGeomID o2, const dContactGeom* found, int count);

// The near callback that the narrow phase stands in for.
struct SerialLoop {
  int flags = 0;
  dParallelSAPFlagsCallback* flags_of = nullptr;  // takes the place of `flags`
  dParallelSAPReduceCallback* reduce = nullptr;
  bool inside = false;   // a space in a pair also collides with itself
  void* data = nullptr;  // of flags_of
  Contacts contacts = {};

  // A dNearCallback.
  static void collide(void* loop, dGeomID o1, dGeomID o2);
};
Contacts serialContacts(dSpaceID space, SerialLoop loop);
// `more` says nothing about contacts.
Contacts parallelContacts(dSpaceID space, int flags, dParallelSAPContactCallbacks more = {});

// Compares all bits; "" or where the lists begin to differ.
std::string difference(const Contacts& got, const Contacts& expected);

// The kinds of geom in the heap: ODE's classes, mesh callbacks and temporal coherence, offset
// geoms.
enum class Kind {
  Sphere,
  Box,
  Capsule,
  Cylinder,
  Convex,
  Torus,
  WatchedTorus,   // with a triangle callback
  MergingTorus,   // with one that merges triangles
  CoherentTorus,  // with temporal coherence for spheres, boxes and capsules
  Ray,
  Transform,  // a box in a dGeomTransform
  User,       // a sphere by a user class
  OffsetBox,  // off its body's centre
  Heightfield,
  FixedHeightfield,   // without place, endless, of copied bytes
  CalledHeightfield,  // whose heights a callback gives
  Plane,
  Count
};

class ContactScene {
 public:
  // An empty one, which destroys its geoms.
  explicit ContactScene(dSpaceID space);
  ~ContactScene();
  ContactScene(const ContactScene&) = delete;
  ContactScene& operator=(const ContactScene&) = delete;

  // A geom of about unit size at a place and in an orientation that the seed decides, in a cube of
  // this side.
  dGeomID add(Kind kind, double side, std::uint64_t seed);
  // n geoms of these kinds in turn, a few near each other.
  void fill(const std::vector<Kind>& kinds, std::size_t n, std::uint64_t seed);
  // Every body and geom a little elsewhere.
  void move(std::uint64_t seed);

 private:
  dSpaceID space_;
  dWorldID world_;
  std::vector<dGeomID> geoms_, placed_;
  // Of this scene alone: ODE's collider writes to them, and scenes may be collided at once.
  std::map<Kind, dHeightfieldDataID> heights_;
};

// In which threads the user's code ran since the last call: only this one?
bool userCodeKeptToThisThread();
// How often it ran.
std::size_t userCodeCalls();

// Frees what the meshes share; before dCloseODE.
void releaseContactShapes();

}  // namespace sap_test
