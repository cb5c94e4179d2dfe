// The narrow phase: ODE's colliders on a list of pairs, by a team of threads. Sees ODE's private
// headers.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/contacts/certainly_apart.h"
#include "space/data/buffer.h"
#include "space/data/parallel.h"
#include "space/data/platform.h"
#include "space/data/tuning.h"
#include "space/geom/assertions.h"

namespace ode_parallel_sap {

// What the caller of dParallelSAPSpaceCollideContacts asked for.
struct ContactRequest {
  void* data;
  int flags;
  dParallelSAPContactCallbacks callbacks;

  int flagsOf(const dParallelSAPPair& pair) const {
    constexpr int known =
        0xffff | static_cast<int>(CONTACTS_UNIMPORTANT) | dParallelSAPOnCallingThread;
    const int of_pair = callbacks.flags ? callbacks.flags(data, pair.o1, pair.o2) : flags;
    require((of_pair & ~known) == 0, "unknown flags for contacts",
            "dParallelSAPSpaceCollideContacts");
    return of_pair;
  }
  void report(const dParallelSAPPair& pair, const dContactGeom* contacts, std::size_t count) const {
    callbacks.contacts(data, pair.o1, pair.o2, contacts, static_cast<int>(count));
  }
};

// Contacts as one thread after the other would have made them: which thread collides a pair depends
// on timing, where its contacts are found again does not.
//
// Pairs are taken in four passes: first all are looked at, those that are certainly apart left out
// (see certainly_apart.h), and the light ones collided on the spot; then the heavy ones, a few at a
// time to whoever is free; then those that want an image of ODE, by threads that have one; at last,
// alone, those that only the calling thread may collide (see collider_threads.h). Each thread
// appends contacts to storage of its own, which is kept for the next frame. In all passes a thread
// begins with a part of the list of its own: neighbours there share geoms, the triangles of a mesh
// for instance, and what is found of them lies side by side for the report.
class NarrowPhase {
 public:
  struct Way {
    int threads;          // the most
    bool manual_cleanup;  // the threads leave no data in ODE
    bool leave_out;       // boxes that are certainly apart
    // Contacts are not reported, but told pair by pair, as dCollide would have left them. What only
    // the calling thread may collide is left out.
    bool tells = false;
    std::size_t one_in = 1;  // of so many chunks of pairs is looked at, in a run that tells
  };
  // Pairs of boxes that were tested whether they are apart, and those that are.
  struct LeftOut {
    std::size_t tested, apart;
  };
  // Collides all pairs; returns the number of threads used. Throws std::bad_alloc, and whatever the
  // flags and reduce callbacks throw.
  int run(const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request, const Way& way);
  // Calls the contact callback for all pairs of the last run that touch, in their order.
  void report(const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request) const;
  // After a run that tells: what dCollide returned for the pair at this place of the list, which is
  // this, and its contacts, every `skip` bytes. -1 where that is not known, or where one of the
  // geoms has come to a body or lost it since.
  int tell(std::size_t place, const dParallelSAPPair& pair, dContactGeom* contacts, int skip) const;
  // Asks for the memory of what is told soon after this place.
  void prefetch(std::size_t place) const {
    place += prefetch_distance;
    if (place >= found_.size() || found_[place].thread == nobody) return;
    const Found& found = found_[place];
    const dContactGeom* const told = shares_[found.thread].contacts.data() + found.first;
    if (found.count) ode_parallel_sap::prefetch(told);
  }
  // Of how many pairs it is known.
  std::size_t precomputed() const;
  void precomputeNothing();
  // How many contacts the pair at this place has, or -1 where that is not known.
  int contactsOf(std::size_t place) const {
    if (place >= found_.size() || found_[place].thread == nobody) return -1;
    return static_cast<int>(found_[place].count);
  }

  // Of the last run.
  std::size_t contacts() const;
  LeftOut leftOut() const;
  std::size_t bytes() const { return bytesOf(shares_, found_, waiting_); }

  // Both at once for one pair after the other, with memory for one pair's contacts only.
  static void collideOneByOne(const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request);

 private:
  // A pair that had to wait, and its flags.
  struct Waiting {
    std::size_t pair;
    int flags;
  };
  struct alignas(64) Share {
    Buffer<dContactGeom> contacts;
    Buffer<Waiting> heavy, image, calling_thread;
    LeftOut left_out = {};

    void clear() {
      contacts.resizeDiscarding(0);
      for (Buffer<Waiting>* const waiting : {&heavy, &image, &calling_thread})
        waiting->resizeDiscarding(0);
      left_out = {};
    }
    std::size_t bytes() const { return bytesOf(contacts, heavy, image, calling_thread); }
  };
  // Contacts [first, first + count) of a thread's share.
  struct Found {
    std::size_t first;
    std::uint32_t count;
    std::uint16_t thread;
    std::uint16_t bodies;  // see bodiesOf(), of a run that tells
  };
  static constexpr std::uint16_t nobody = 0xffff;  // collided it
  // Which geoms of a pair have a body, and an offset from it: either comes without a notice.
  static std::uint16_t bodiesOf(const dParallelSAPPair& pair);
  class Pass;

  int lookAtAll(const Pass& pass, int threads);
  int collideHeavy(const Pass& pass, int threads);
  int collideOnImages(const Pass& pass, int threads);
  void collideRest(const Pass& pass);
  void reportBlock(Range block, const Buffer<dParallelSAPPair>& pairs,
                   const ContactRequest& request) const;

  std::vector<Share> shares_;  // by thread
  Buffer<Found> found_;        // by pair
  Buffer<Waiting> waiting_;
};

}  // namespace ode_parallel_sap
