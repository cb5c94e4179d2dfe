// The narrow phase: ODE's colliders on a list of pairs, by a team of threads.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "space/base/buffer.h"
#include "space/base/pair_list.h"
#include "space/contacts/collider_threads.h"
#include "space/geoms/geom_tests.h"

namespace ode_parallel_sap {

class ContactPairs;
struct Scene;

// Whether a contact's depth, normal and place are numbers that a joint can use.
bool isFinite(const dContactGeom& contact);

// The arguments of dParallelSAPSpaceCollideContacts.
struct ContactRequest {
  void* data;
  int flags;
  dParallelSAPContactCallbacks callbacks;
  // Of the preload library, or null: flags by the place of a pair, and what the room for its
  // contacts is to hold before dCollide writes there.
  int (*flags_at)(void* data, std::size_t place, const dParallelSAPPair& pair) = nullptr;
  void (*prepare)(dContactGeom* contacts, int count) = nullptr;

  int flagsOf(const dParallelSAPPair& pair, std::size_t place = 0) const {
    constexpr int known =
        0xffff | static_cast<int>(CONTACTS_UNIMPORTANT) | dParallelSAPOnCallingThread;
    if (flags_at) return flags_at(data, place, pair);
    const int of_pair = callbacks.flags ? callbacks.flags(data, pair.o1, pair.o2) : flags;
    require((of_pair & ~known) == 0, "unknown flags for contacts",
            "dParallelSAPSpaceCollideContacts");
    return of_pair;
  }
  void report(const dParallelSAPPair& pair, const dContactGeom* contacts, std::size_t count) const {
    callbacks.contacts(data, pair.o1, pair.o2, contacts, static_cast<int>(count));
  }
};

// Finds contacts on all threads. Timing decides which thread collides a pair, but not where its
// contacts are found again: they are reported in the order of the pairs.
//
// There are four passes: all pairs, of which light ones are collided on the spot; heavy pairs, a
// few at a time; pairs for threads with a collider of their own; and pairs that only the calling
// thread may collide (collider_threads.h). Each thread begins with its own part of the list, whose
// pairs share geoms.
class NarrowPhase {
 public:
  // Collides all pairs, by up to `threads` threads, which with `manual_cleanup` leave no data in
  // ODE; returns how many worked. Throws std::bad_alloc, and whatever the flags and reduce
  // callbacks throw. `touches`: by pair, or null.
  int run(const Buffer<dParallelSAPPair>& pairs, const ContactRequest& request, int threads,
          bool manual_cleanup, const Touch* touches = nullptr);
  // Calls the contact callback for pairs of the last run that touch and are still there, in order.
  void report(ContactPairs& pairs, const ContactRequest& request);

  // Of the last run: the contacts of the pair at a place, and of all pairs.
  struct Contacts {
    const dContactGeom* data;
    std::size_t count;
  };
  Contacts contactsOf(std::size_t pair) const {
    const Found& found = found_[pair];
    return {shares_[found.thread].contacts.data() + found.first, found.count};
  }
  bool touches(std::size_t pair) const { return found_[pair].count != 0; }
  // Ascending, if run() got touches: the pairs that have a touch and none now, or conversely.
  const Buffer<Touch>& changed() const { return changed_; }
  std::size_t contacts() const;
  std::size_t bytes() const { return bytesOf(shares_, found_, waiting_, changed_); }

  // Both at once for one pair after the other, with memory for one pair's contacts only.
  static void collideOneByOne(ContactPairs& pairs, const ContactRequest& request);
  static void collideOne(const dParallelSAPPair& pair, const ContactRequest& request,
                         const Scene& scene);

 private:
  struct Job {
    const Buffer<dParallelSAPPair>& pairs;
    const ContactRequest& request;
    int threads;
    const Touch* touches;
  };
  // A pair that had to wait, and its flags.
  struct Waiting {
    std::size_t pair;
    int flags;
  };
  struct alignas(64) Share {
    Buffer<dContactGeom> contacts;
    Buffer<Waiting> heavy, own_collider, calling_thread;
    Buffer<Touch> changed;
    std::size_t bytes() const {
      return bytesOf(contacts, heavy, own_collider, calling_thread, changed);
    }
  };
  // Contacts [first, first + count) of a thread's share.
  struct Found {
    std::size_t first;
    std::uint32_t count, thread;
  };

  void collideOrQueue(const Job& job, const Waiting& waiting, int thread);
  void collide(const Job& job, const Waiting& waiting, int thread, ThreadCollider* own = nullptr);
  void noteTouch(const Job& job, std::size_t pair, bool touches, int thread) {
    if (job.touches && touches != (job.touches[pair] != no_touch))
      shares_[thread].changed.push_back(static_cast<Touch>(pair));
  }

  std::vector<Share> shares_;  // by thread
  Buffer<Found> found_;        // by pair
  bool told_of_nan_ = false;
  Buffer<Waiting> waiting_;
  Buffer<Touch> changed_;
};

}  // namespace ode_parallel_sap
