#include "space/frame/touch_events.h"

#include <algorithm>
#include <functional>
#include <new>
#include <utility>

namespace ode_parallel_sap {

void TouchEvents::beginFrame(PairEvents& pairs, bool contacts) {
  for (const PairEvents::Event& event : direct_.ended()) pairs.pool().drop(event.number);
  giveBack(next_within_, pairs.pool(), /*all=*/false);
  direct_.updateUnknown();
  no_contacts_ = !contacts;
}

void TouchEvents::end(PairEvents& pairs) {
  pairs.pool().dropAll();
  giveBack(next_within_, pairs.pool(), /*all=*/false);
  giveBack(within_, pairs.pool(), /*all=*/true);
}

void TouchEvents::giveBack(Buffer<Within>& touches, PairNumbers& pool, bool all) {
  for (const Within& touch : touches)
    if (all || !touch.lasts) pool.give(touch.number);
  touches.resizeDiscarding(0);
}

bool TouchEvents::update(const ContactPairs& contacts, const NarrowPhase& found, PairEvents& pairs,
                         const PackRules& rules, int threads) try {
  const Buffer<dxGeom*>& geoms = contacts.scene().slots;
  list(contacts, found, pairs);
  chooseBit(geoms);
  match();
  if (ended_) findPresent(geoms);
  pairs.pool().reserve(begun_);
  pairs.pool().reserveHeld();
  const PairEvents::Given given = {numbers_, places_, begun_, ended_};
  if (!direct_.update(pairs_, geoms, rules, threads, &given)) throw std::bad_alloc();
  for (const PairEvents::Event& event : direct_.begun()) pairs.pool().hold(event.number);
  writeWithin(pairs.pool());
  return true;
} catch (const std::bad_alloc&) {
  next_within_.resizeDiscarding(0);
  return false;
}

// The pairs that touch, in their order. Those with geoms in sub-spaces stand in the list in the
// place of the pair of spaces.
void TouchEvents::list(const ContactPairs& contacts, const NarrowPhase& found,
                       const PairEvents& pairs) {
  const Buffer<dxGeom*>& geoms = contacts.scene().slots;
  const Buffer<dParallelSAPPair>& list = contacts.list();
  const Buffer<Pair>& slots = contacts.slots();  // empty: the list is that of the pairs
  const Buffer<Pair>& all = pairs.list();
  pairs_.clear(1);
  Buffer<Pair>& touching = pairs_.parts[0];
  touching.resizeDiscarding(list.size());
  numbers_.resizeDiscarding(list.size());
  places_.resizeDiscarding(list.size());
  next_within_.resizeDiscarding(0);
  std::size_t place = 0, touches = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (!found.touches(i)) continue;
    if (slots.size() == 0) {
      place = i;
    } else {
      const auto [o1, o2] = list[i];
      const Slot a = earlierOf(slots[i]), b = laterOf(slots[i]);
      const Pair pair = makePair(std::min(a, b), std::max(a, b));
      while (place < all.size() && all[place] < pair) ++place;
      if (place == all.size() || all[place] != pair || geoms[earlierOf(pair)] != o1 ||
          geoms[laterOf(pair)] != o2) {
        next_within_.push_back({o1, o2, place, 0, false});
        continue;
      }
    }
    touching[touches] = all[place];
    numbers_[touches] = pairs.numbers()[place];
    places_[touches++] = place;
  }
  touching.resize(touches);
  pairs_.addParts(/*decided=*/true);
  numbers_.resize(touches);
  places_.resize(touches);
}

// The entry of the touch of two geoms, in any order, or a free one. Entries count from 1, first the
// touches of the last frame, then those of this one.
std::uint32_t& TouchEvents::entryOf(const dxGeom* o1, const dxGeom* o2) {
  const auto bits = [](const dxGeom* geom) { return reinterpret_cast<std::uintptr_t>(geom) >> 4; };
  // fixed: any odd number with bits all over
  std::uint64_t hash = (bits(o1) ^ bits(o2)) * 0x9e3779b97f4a7c15u + bits(o1) + bits(o2);
  hash ^= hash >> 32;
  const std::size_t last = within_.size();
  for (std::size_t at = hash;; ++at) {
    std::uint32_t& entry = table_[at & (table_.size() - 1)];
    if (entry == 0) return entry;
    const Within& touch = entry <= last ? within_[entry - 1] : next_within_[entry - 1 - last];
    if ((touch.o1 == o1 && touch.o2 == o2) || (touch.o1 == o2 && touch.o2 == o1)) return entry;
  }
}

// By how deep the space is in others.
void TouchEvents::chooseBit(const Buffer<dxGeom*>& geoms) {
  unsigned depth = 0;
  for (const dxGeom* const geom : geoms) {
    if (!geom) continue;
    for (const dxSpace* space = geom->parent_space; space; space = space->parent_space) ++depth;
    break;
  }
  touching_ = lowest_touching << depth % 4;
}

// Finds which touches in sub-spaces last. One that the program's callback added twice counts once.
// A geom without the flag is another one than that of its address in the last frame.
void TouchEvents::match() {
  begun_ = ended_ = 0;
  if (within_.size() + next_within_.size() == 0) return;
  std::size_t size = 1;
  while (size < 2 * (within_.size() + next_within_.size())) size *= 2;
  table_.resizeDiscarding(size);
  std::fill(table_.begin(), table_.end(), 0);
  std::uint32_t entries = 0;
  for (Within& touch : within_) {
    entryOf(touch.o1, touch.o2) = ++entries;
    touch.lasts = false;
  }
  const std::size_t last = within_.size();
  std::size_t kept = 0;
  for (const Within& found : next_within_) {
    std::uint32_t& entry = entryOf(found.o1, found.o2);
    if (entry > last) continue;
    Within touch = found;
    if (entry && found.o1->gflags & found.o2->gflags & touching_) {
      Within& before = within_[entry - 1];
      before.lasts = touch.lasts = true;
      touch.number = before.number;
    }
    begun_ += !touch.lasts;
    next_within_[kept++] = touch;
    entry = ++entries;
  }
  next_within_.resize(kept);
  ended_ = static_cast<std::size_t>(
      std::count_if(within_.begin(), within_.end(), [](const Within& t) { return !t.lasts; }));
}

// Leaves in present_ the geoms of ended touches that are still in the space. No other is read.
void TouchEvents::findPresent(const Buffer<dxGeom*>& geoms) {
  left_.resizeDiscarding(0);
  for (const Within& touch : within_)
    if (!touch.lasts) {
      left_.push_back(touch.o1);
      left_.push_back(touch.o2);
    }
  std::sort(left_.begin(), left_.end(), std::less<dxGeom*>());
  present_.resizeDiscarding(0);
  for (dxGeom* const geom : geoms)
    if (geom) notePresent(geom);
  std::sort(present_.begin(), present_.end(), std::less<dxGeom*>());
}

void TouchEvents::notePresent(dxGeom* geom) {
  if (IS_SPACE(geom))
    for (dxGeom* own = static_cast<dxSpace*>(geom)->first; own; own = own->next) notePresent(own);
  else if (geom->gflags & touching_ &&
           std::binary_search(left_.begin(), left_.end(), geom, std::less<dxGeom*>()))
    present_.push_back(geom);
}

// There is room for all events and numbers.
void TouchEvents::writeWithin(PairNumbers& pool) {
  Buffer<PairEvents::Event>&begun = direct_.begun(), &ended = direct_.ended();
  const std::size_t direct_begun = begun.size(), direct_ended = ended.size();
  const auto ifPresent = [this](dxGeom* geom) {
    const bool is =
        std::binary_search(present_.begin(), present_.end(), geom, std::less<dxGeom*>());
    return is ? geom : nullptr;
  };
  for (const Within& touch : within_)
    if (!touch.lasts)
      ended.push_back({ifPresent(touch.o1), ifPresent(touch.o2), touch.place, touch.number});
  for (Within& touch : next_within_) {
    touch.o1->gflags |= touching_;
    touch.o2->gflags |= touching_;
    if (touch.lasts) continue;
    touch.number = pool.take();
    begun.push_back({touch.o1, touch.o2, touch.place, touch.number});
  }
  const auto isBefore = [](const PairEvents::Event& a, const PairEvents::Event& b) {
    return a.place < b.place;
  };
  std::inplace_merge(begun.begin(), begun.begin() + direct_begun, begun.end(), isBefore);
  std::inplace_merge(ended.begin(), ended.begin() + direct_ended, ended.end(), isBefore);
  std::swap(within_, next_within_);
}

void TouchEvents::release() {
  direct_.release();
  pairs_ = PairList();
  numbers_.release();
  places_.release();
  table_.release();
  left_.release();
  present_.release();
}

}  // namespace ode_parallel_sap
