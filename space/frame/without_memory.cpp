#include "space/frame/without_memory.h"

#include <algorithm>
#include <limits>
#include <new>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/geoms/pair_rule.h"

namespace ode_parallel_sap {

namespace {

// The geoms of some slots, and their pairs with later geoms, in the room that there is. They are
// found by a binary tree over AABBs: the children of node i are 2 i and 2 i + 1, each has half of
// its geoms, and all leaves are at one depth.
class Part {
 public:
  static constexpr std::size_t least_geoms = 64;  // 6 KB, which the stack of any thread has

  // The room for so many geoms, in words of 64 bits.
  static constexpr std::size_t wordsFor(std::size_t geoms) {
    return pairs_a_geom * geoms +
           (geoms * sizeof(Member) + 2 * leavesFor(geoms) * sizeof(Bounds)) / sizeof(Pair) + 1;
  }
  Part(Pair* room, std::size_t geoms)
      : pairs_(room),
        most_pairs_(pairs_a_geom * geoms - 1),  // one is written and not counted
        nodes_(reinterpret_cast<Bounds*>(room + most_pairs_ + 1)),
        members_(reinterpret_cast<Member*>(nodes_ + 2 * leavesFor(geoms))) {}

  // Takes the geoms of slots [begin, end). Needs exactMode().
  void take(const Buffer<dxGeom*>& geoms, std::size_t begin, std::size_t end) {
    count_ = 0;
    for (std::size_t slot = begin; slot < end; ++slot) {
      const dxGeom* const geom = geoms[slot];
      if (!geom || hasNaN(geom)) continue;
      std::copy_n(geom->aabb, 6, members_[count_].bounds.aabb);
      members_[count_++].slot = static_cast<Slot>(slot);
    }
    leaves_ = leavesFor(count_);
    for (std::size_t nodes = 1; nodes < leaves_; nodes *= 2)
      for (std::size_t node = 0; node < nodes; ++node) halve(membersOf(node, nodes));
    for (std::size_t node = 2 * leaves_ - 1; node > 0; --node) {
      Bounds& bounds = nodes_[node];
      bounds = Bounds();
      if (node < leaves_) {
        bounds.include(nodes_[2 * node]);
        bounds.include(nodes_[2 * node + 1]);
      } else {
        const Range range = membersOf(node - leaves_, leaves_);
        for (std::size_t i = range.begin; i < range.end; ++i) bounds.include(members_[i].bounds);
      }
    }
  }
  // Adds the pairs of an AABB in a slot with members in earlier slots below `end`. Needs
  // exactMode(), and room for a pair with each of these. No branch depends on a member.
  void addPairsOf(const dReal* aabb, std::size_t slot, std::size_t end) {
    for (std::size_t node = 1;;) {
      const bool reached = nodes_[node].overlaps(aabb);
      if (reached && node < leaves_) {
        node *= 2;
        continue;
      }
      if (reached) {
        const Range range = membersOf(node - leaves_, leaves_);
        for (std::size_t i = range.begin; i < range.end; ++i) {
          const Slot own = members_[i].slot;
          pairs_[pair_count_] = makePair(own, static_cast<Slot>(slot));
          pair_count_ += (own < slot) & (own < end) & members_[i].bounds.overlaps(aabb);
        }
      }
      for (++node; node % 2 == 0;) node /= 2;  // after a second child comes what follows its parent
      if (node == 1) return;
    }
  }
  // The same of its member at a place: neighbours follow each other.
  void addPairsOfMember(std::size_t place, std::size_t end) {
    addPairsOf(members_[place].bounds.aabb, members_[place].slot, end);
  }
  std::size_t members() const { return count_; }
  std::size_t room() const { return most_pairs_ - pair_count_; }
  void dropPairsFrom(std::size_t end) {
    const Pair* const last = std::remove_if(pairs_, pairs_ + pair_count_,
                                            [=](Pair pair) { return earlierOf(pair) >= end; });
    pair_count_ = static_cast<std::size_t>(last - pairs_);
  }
  // Calls use(pair) for the pairs, in their order, and drops them.
  template <class Use>
  void usePairs(Use use) {
    std::sort(pairs_, pairs_ + pair_count_);
    for (std::size_t i = 0; i < pair_count_; ++i) use(pairs_[i]);
    pair_count_ = 0;
  }

 private:
  static constexpr dReal infinity = std::numeric_limits<dReal>::infinity();
  struct Bounds {
    dReal aabb[6] = {infinity, -infinity, infinity, -infinity, infinity, -infinity};
    bool overlaps(const dReal* other) const {
      return (aabb[0] <= other[1]) & (other[0] <= aabb[1]) & (aabb[2] <= other[3]) &
             (other[2] <= aabb[3]) & (aabb[4] <= other[5]) & (other[4] <= aabb[5]);
    }
    void include(const Bounds& other) {
      for (int i = 0; i < 6; i += 2) {
        aabb[i] = std::min(aabb[i], other.aabb[i]);
        aabb[i + 1] = std::max(aabb[i + 1], other.aabb[i + 1]);
      }
    }
  };
  struct Member {
    Bounds bounds;
    Slot slot;
  };

  static constexpr std::size_t pairs_a_geom = 4, leaf_members = 8;  // round numbers

  static constexpr std::size_t leavesFor(std::size_t members) {
    std::size_t leaves = 1;
    while (leaves * leaf_members < members) leaves *= 2;
    return leaves;
  }
  Range membersOf(std::size_t node, std::size_t of) const {
    return {count_ * node / of, count_ * (node + 1) / of};
  }
  // Puts the lower half of members in front, along the axis where they are spread most.
  void halve(Range range) {
    Member *const begin = members_ + range.begin, *const end = members_ + range.end;
    int widest = 0;
    dReal most = -1;
    for (int axis = 0; axis < 6; axis += 2) {
      dReal least = infinity, greatest = -infinity;
      for (const Member* each = begin; each < end; ++each) {
        least = std::min(least, each->bounds.aabb[axis]);
        greatest = std::max(greatest, each->bounds.aabb[axis]);
      }
      if (!(greatest - least > most)) continue;
      most = greatest - least;
      widest = axis;
    }
    std::nth_element(begin, members_ + (range.begin + range.end) / 2, end,
                     [=](const Member& a, const Member& b) {
                       return a.bounds.aabb[widest] < b.bounds.aabb[widest];
                     });
  }

  Pair* const pairs_;
  const std::size_t most_pairs_;
  Bounds* const nodes_;
  Member* const members_;
  std::size_t pair_count_ = 0, count_ = 0, leaves_ = 1;
};

// Calls use(pair) for the pairs of AABBs that overlap, in their order: those of as many earlier
// geoms at a time as there is room for.
template <class Use>
void findInParts(const Buffer<dxGeom*>& geoms, std::size_t most, Part part, Use use) {
  const std::size_t count = geoms.size();
  std::size_t wanted = most;
  for (std::size_t begin = 0, end; begin < count; begin = end) {
    const std::size_t behind = end = std::min(count, begin + wanted);
    {
      const ScopedMode mode(exactMode());
      part.take(geoms, begin, end);
    }
    const auto makeRoom = [&] {
      while (part.room() < end - begin)
        if (end - begin > 1)
          part.dropPairsFrom(end = begin + (end - begin) / 2);
        else
          part.usePairs(
              use);  // of one geom with those behind: they are in their order as they come
    };
    for (std::size_t place = 0; place < part.members(); ++place) {
      makeRoom();
      const ScopedMode mode(exactMode());
      part.addPairsOfMember(place, end);
    }
    for (std::size_t slot = behind; slot < count; ++slot) {
      makeRoom();
      const ScopedMode mode(exactMode());
      if (geoms[slot]) part.addPairsOf(geoms[slot]->aabb, slot, end);
    }
    part.usePairs(use);
    wanted = std::min(most, 2 * (end - begin));
  }
}

// Leaves an eighth as much to the program, which may need some, too.
bool hasRoom(Buffer<Pair>& room, std::size_t geoms) try {
  Buffer<Pair> left;
  left.resize(Part::wordsFor(geoms) / 8);
  room.resize(Part::wordsFor(geoms));
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

// Returns for how many geoms there is room; 0: the stack has more.
std::size_t makeRoom(Buffer<Pair>& room, std::size_t count) {
  std::size_t geoms = count;
  while (geoms > Part::least_geoms && !hasRoom(room, geoms)) geoms /= 2;
  return geoms > Part::least_geoms ? geoms : 0;
}

// Not inline: only what finds no memory at all has it on the stack.
template <class Use>
__attribute__((noinline)) void findOnStack(const Buffer<dxGeom*>& geoms, Use use) {
  Pair room[Part::wordsFor(Part::least_geoms)];
  findInParts(geoms, Part::least_geoms, {room, Part::least_geoms}, use);
}

// Both without AABBTest functions; the latter of geoms whose AABBs overlap.
bool isPair(const PairRule& rule, dxGeom* a, dxGeom* b) {
  const ScopedMode mode(exactMode());
  return PairRule::takesPart(a) && rule.isPair(a, b);
}
bool mayPair(const PairRule& rule, dxGeom* a, dxGeom* b) {
  const ScopedMode mode(exactMode());
  return PairRule::takesPart(a) && PairRule::takesPart(b) && rule.mayPair(a, b);
}

}  // namespace

dParallelSAPStats updateWithoutMemory(const Scene& scene) {
  FrameCounts counts;
  counts.geoms = static_cast<unsigned>(scene.count);
  counts.moved = cleanOneByOne(scene.first).moved;
  scene.noteClean();
  for (const dxGeom* geom = scene.first; geom; geom = geom->next) {
    const bool invalid = isEnabled(geom) && hasNaN(geom);
    counts.disabled += !isEnabled(geom);
    counts.invalid += invalid;
    counts.unbounded += isEnabled(geom) && !invalid && isUnbounded(geom);
  }
  return statsOf(counts);
}

void collideWithoutMemory(const Scene& scene, const PackRules& rules, Buffer<Pair>* room,
                          dParallelSAPStats& stats, const PairReceiver& receiver) {
  const PairRule rule(rules);
  const Reports::Open open(scene.reports, receiver.opens);
  const Buffer<dxGeom*>& geoms = scene.slots;
  // Asked before each pair: the callback may disable or destroy them.
  const auto report = [&](Pair pair) {
    dxGeom *const a = geoms[earlierOf(pair)], *const b = geoms[laterOf(pair)];
    if (!a || !b || !mayPair(rule, a, b)) return;
    ++stats.candidates;
    if (!passesAABBTests(a, b)) return;
    ++stats.pairs;
    receiver.callback(receiver.data, a, b);
  };
  const std::size_t most = room ? makeRoom(*room, geoms.size()) : 0;
  if (most > 0)
    findInParts(geoms, most, {room->data(), most}, report);
  else
    findOnStack(geoms, report);
  if (receiver.end) receiver.end(receiver.data);
}

void queryWithoutMemory(const Scene& scene, const PackRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback) {
  PackRules of_queries;
  of_queries.cull_planes = rules.cull_planes;
  const PairRule rule(of_queries);
  const Reports::Open open(scene.reports);
  const Buffer<dxGeom*>& geoms = scene.slots;
  const std::size_t count = geoms.size();
  const auto probe =
      static_cast<std::size_t>(std::find(geoms.begin(), geoms.end(), geom) - geoms.begin());
  for (std::size_t slot = 0; slot < count && (probe == count || geoms[probe] == geom); ++slot)
    if (dxGeom* const own = geoms[slot])
      if (isPair(rule, own, geom) && passesAABBTests(own, geom)) callback(data, own, geom);
}

}  // namespace ode_parallel_sap
