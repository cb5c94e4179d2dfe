#include "space/frame/without_memory.h"

#include <algorithm>
#include <new>
#include <utility>

#include "space/base/floating_point.h"
#include "space/base/parallel.h"
#include "space/base/round_to_floats.h"
#include "space/base/tuning.h"
#include "space/geoms/geom_tests.h"
#include "space/pairs/cell_order.h"
#include "space/pairs/cell_trees.h"
#include "space/simd/kernels.h"

namespace ode_parallel_sap {

namespace {

// The geoms of some slots, in cells with a tree over them, and their pairs with later geoms, in the
// room that there is. Boxes are the AABBs, as doubles: no scale or distance makes many of them one.
class Part {
 public:
  static constexpr std::size_t least_geoms = 64;  // 7 KB, which the stack of any thread has

  // The room for so many geoms, in words of 64 bits, which begins with a cache line.
  static constexpr std::size_t wordsFor(std::size_t geoms) {
    return treeWordsFor(geoms) + pairs_a_geom * geoms + (geoms + group_size + 1) / 2;
  }
  Part(const Buffer<dxGeom*>& geoms, Pair* room, std::size_t most)
      : geoms_(geoms),
        cells_(reinterpret_cast<Group<double>*>(room)),
        pairs_(room + treeWordsFor(most)),
        most_pairs_(pairs_a_geom * most - 1),  // one is written and not counted
        found_(reinterpret_cast<std::uint32_t*>(pairs_ + pairs_a_geom * most)) {}

  // Takes the geoms of slots [begin, end). Needs exactMode().
  void take(std::size_t begin, std::size_t end) {
    Centre* const centres = reinterpret_cast<Centre*>(pairs_);  // there are no pairs yet
    count_ = 0;
    for (std::size_t slot = begin; slot < end; ++slot) {
      if (!geoms_[slot] || hasNaN(geoms_[slot])) continue;
      const BasicBox<double> box = boxOf(geoms_[slot]);
      Centre& centre = centres[count_++];
      for (int axis = 0; axis < 3; ++axis) centre.at[axis] = centreOf(box, axis);
      centre.slot = static_cast<Slot>(slot);
    }
    cut(centres, count_);
    std::size_t groups = std::max<std::size_t>(groupsFor(count_), 1);
    for (std::size_t place = 0; place < groups * group_size; ++place) {
      Group<double>& cell = cells_[place / group_size];
      const bool used = place < count_;
      if (place + prefetch_distance < count_) prefetchAt(centres[place + prefetch_distance].slot);
      cell.slot[place % group_size] = used ? centres[place].slot : 0;
      put(used ? boxOf(geoms_[centres[place].slot]) : inactiveBox<double>(), cell,
          place % group_size);
    }
    Group<double>* level = cells_;
    tree_.levels[0] = level;
    tree_.depth = 1;
    do {
      const std::size_t children = std::exchange(groups, groupsFor(groups));
      kernels<double>().packBounds(level, children, 0, groups, level + children);
      tree_.levels[tree_.depth++] = level += children;
    } while (groups > 1);
  }
  // Adds the pairs of a geom with those taken from earlier slots below `end`. Needs exactMode(),
  // and room for a pair with each of these.
  void addPairsOf(std::size_t slot, std::size_t end) {
    if (geoms_[slot]) addPairsOf(boxOf(geoms_[slot]), static_cast<Slot>(slot), end);
  }
  // The same of one that was taken, by its place: neighbours follow each other.
  void addPairsAt(std::size_t place, std::size_t end) {
    const Group<double>& cell = cells_[place / group_size];
    const std::size_t lane = place % group_size;
    BasicBox<double> box;
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = cell.lower[axis][lane];
      box.upper[axis] = cell.upper[axis][lane];
    }
    addPairsOf(box, cell.slot[lane], end);
  }
  std::size_t places() const { return count_; }
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
    for (std::size_t i = 0; i < pair_count_; ++i) {
      if (i + prefetch_distance < pair_count_) prefetchAt(laterOf(pairs_[i + prefetch_distance]));
      use(pairs_[i]);
    }
    pair_count_ = 0;
  }

 private:
  static constexpr std::size_t pairs_a_geom = 4;  // a round number

  struct Centre {
    double at[3];
    Slot slot;
  };
  static_assert(sizeof(Centre) <= pairs_a_geom * sizeof(Pair));

  // Cells and the nodes above them, of which there is one at least.
  static constexpr std::size_t treeWordsFor(std::size_t geoms) {
    std::size_t groups = std::max<std::size_t>(groupsFor(geoms), 1), all = groups;
    do all += groups = groupsFor(groups);
    while (groups > 1);
    return all * sizeof(Group<double>) / sizeof(Pair);
  }
  void prefetchAt(Slot slot) const {
    if (geoms_[slot]) prefetchObject(geoms_[slot], sizeof(dxGeom));
  }
  static BasicBox<double> boxOf(const dxGeom* geom) { return boxOfBounds<double>(geom->aabb); }
  // Halves centres along the axis on which they lie farthest apart until a cell of them is left.
  static void cut(Centre* centres, std::size_t count) {
    if (count <= group_size) return;
    int widest = 0;
    double most = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least, greatest] = std::minmax_element(
          centres, centres + count,
          [=](const Centre& a, const Centre& b) { return a.at[axis] < b.at[axis]; });
      const double spread = greatest->at[axis] - least->at[axis];
      if (!(spread > most)) continue;
      most = spread;
      widest = axis;
    }
    const std::size_t half = groupsFor(count) / 2 * group_size;
    std::nth_element(centres, centres + half, centres + count,
                     [=](const Centre& a, const Centre& b) { return a.at[widest] < b.at[widest]; });
    cut(centres, half);
    cut(centres + half, count - half);
  }

  void addPairsOf(const BasicBox<double>& box, Slot slot, std::size_t end) {
    Group<double> query;
    put(box, query, 0);
    query.slot[0] = ~Slot{0};
    const std::size_t finds = kernels<double>().findInTree(tree_, query, found_);
    for (std::size_t i = 0; i < finds; ++i) {
      const Slot own = found_[i] / 2;
      pairs_[pair_count_] = makePair(own, slot);
      pair_count_ += own < slot && own < end;
    }
  }

  const Buffer<dxGeom*>& geoms_;
  Group<double>* const cells_;  // and the nodes above them
  Pair* const pairs_;
  const std::size_t most_pairs_;
  std::uint32_t* const found_;
  TreeView<double> tree_ = {};
  std::size_t pair_count_ = 0, count_ = 0;
};

// Calls use(pair) for the pairs of AABBs that overlap, in their order: those of as many earlier
// geoms at a time as there is room for.
template <class Use>
void findInParts(std::size_t count, std::size_t most, Part part, Use use) {
  std::size_t wanted = most;
  for (std::size_t begin = 0, end; begin < count; begin = end) {
    const std::size_t behind = end = std::min(count, begin + wanted);
    const auto makeRoom = [&] {
      while (part.room() < end - begin)
        if (end - begin > 1)
          part.dropPairsFrom(end = begin + (end - begin) / 2);
        else  // of one geom with those behind, in their order as they come
          part.usePairs(use);
    };
    {
      const ScopedMode mode(exactMode());
      part.take(begin, end);
    }
    for (std::size_t place = 0; place < part.places(); ++place) {
      makeRoom();
      const ScopedMode mode(exactMode());
      part.addPairsAt(place, end);
    }
    for (std::size_t slot = behind; slot < count; ++slot) {
      makeRoom();
      const ScopedMode mode(exactMode());
      part.addPairsOf(slot, end);
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
  alignas(64) Pair room[Part::wordsFor(Part::least_geoms)];
  findInParts(geoms.size(), Part::least_geoms, {geoms, room, Part::least_geoms}, use);
}

// The AABBTest functions apart.
bool isHitOf(const dxGeom* geom, const dxGeom* own, const PairRules& rules) {
  const ScopedMode mode(exactMode());
  return boxesOverlap(own, geom) && rules.isHit(own, geom);
}

}  // namespace

dParallelSAPStats updateWithoutMemory(const Scene& scene) {
  FrameCounts counts;
  counts.geoms = static_cast<unsigned>(scene.count);
  counts.moved = cleanOneByOne(scene.first).moved;
  scene.noteClean();
  const ScopedMode mode(exactMode());
  for (const dxGeom* geom = scene.first; geom; geom = geom->next) {
    Box box;
    const BoundsFacts facts = isEnabled(geom) ? roundToFloats(geom->aabb, box) : 0;
    counts.disabled += !isEnabled(geom);
    counts.invalid += (facts & nan_bounds) != 0;
    counts.unbounded += (facts & unbounded_bounds) && !(facts & nan_bounds);
  }
  return statsOf(counts);
}

void collideWithoutMemory(const Scene& scene, const PairRules& rules, Buffer<Pair>* room,
                          dParallelSAPStats& stats, const PairReceiver& receiver) {
  const Reports::Open open(scene.reports, receiver.opens);
  const Buffer<dxGeom*>& geoms = scene.slots;
  // The callback may disable or destroy geoms of later pairs.
  const auto takesPart = [](const dxGeom* geom) {
    return geom && isEnabled(geom) && !hasNaN(geom);
  };
  const auto mayPair = [&](dxGeom* a, dxGeom* b) {
    const ScopedMode mode(exactMode());
    return takesPart(a) && takesPart(b) && rules.mayPair(a, b);
  };
  const auto report = [&](Pair pair) {
    dxGeom *const a = geoms[earlierOf(pair)], *const b = geoms[laterOf(pair)];
    if (!mayPair(a, b)) return;
    ++stats.candidates;
    if (!passesAABBTests(a, b)) return;
    ++stats.pairs;
    receiver.callback(receiver.data, a, b);
  };
  const std::size_t most = room ? makeRoom(*room, geoms.size()) : 0;
  if (most > 0)
    findInParts(geoms.size(), most, {geoms, room->data(), most}, report);
  else
    findOnStack(geoms, report);
  if (receiver.end) receiver.end(receiver.data);
}

void queryWithoutMemory(const Scene& scene, const PairRules& rules, dxGeom* geom, void* data,
                        dNearCallback* callback) {
  const Reports::Open open(scene.reports);
  const Buffer<dxGeom*>& geoms = scene.slots;
  const std::size_t count = geoms.size();
  const auto probe =
      static_cast<std::size_t>(std::find(geoms.begin(), geoms.end(), geom) - geoms.begin());
  for (std::size_t slot = 0; slot < count && (probe == count || geoms[probe] == geom); ++slot)
    if (dxGeom* const own = geoms[slot])
      if (isHitOf(geom, own, rules) && passesAABBTests(own, geom)) callback(data, own, geom);
}

}  // namespace ode_parallel_sap
