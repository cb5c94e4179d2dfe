#include "space/frame/touch_events.h"

#include <algorithm>
#include <new>
#include <utility>

#include "space/base/parallel.h"
#include "space/base/tuning.h"

namespace ode_parallel_sap {

namespace {

Region noting("touch events: places");

// fixed: any odd number with bits all over
std::size_t hashOf(std::uintptr_t bits) {
  const std::uint64_t hash = (bits >> 4) * 0x9e3779b97f4a7c15u;
  return hash ^ hash >> 32;
}

}  // namespace

void TouchEvents::beginFrame(PairEvents& pairs, bool contacts) {
  begun_.resizeDiscarding(0);
  ended_.resizeDiscarding(0);
  giveBack(next_within_, pairs.pool(), /*all=*/false);
  no_contacts_ = !contacts;
}

void TouchEvents::end(PairEvents& pairs) {
  giveBack(next_within_, pairs.pool(), /*all=*/false);
  giveBack(within_, pairs.pool(), /*all=*/true);
  pairs.forgetTouches();
}

void TouchEvents::giveBack(Buffer<Within>& touches, PairNumbers& pool, bool all) {
  for (const Within& touch : touches)
    if (all || !touch.lasts) pool.give(touch.number);
  touches.resizeDiscarding(0);
}

bool TouchEvents::update(const ContactPairs& contacts, const NarrowPhase& found, PairEvents& pairs,
                         const PairRules& rules, int threads) try {
  const Buffer<dxGeom*>& geoms = contacts.scene().slots;
  touching_ = PairEvents::touchingBit(geoms);
  takeOutlived(pairs);
  changed_.resizeDiscarding(0);
  next_within_.resizeDiscarding(0);
  if (contacts.isOfScene())
    for (const Touch place : found.changed()) changed_.push_back(place);
  else
    listTouches(contacts, found, pairs);
  if (outlive_) listAgain(geoms, pairs);
  const std::size_t begun_within = match(), ended_within = findEnded(geoms, rules);
  begun_.reserve(changed_.size() + begun_within);
  ended_.reserve(changed_.size() + ended_within + pairs.endedTouches().size());
  pairs.pool().reserve(begun_within);
  writeOwn(geoms, pairs, threads);
  writeWithin(pairs.pool());
  PairEvents::sortByPlace(begun_);
  PairEvents::sortByPlace(ended_);
  return true;
} catch (const std::bad_alloc&) {
  next_within_.resizeDiscarding(0);
  return false;
}

void TouchEvents::takeOutlived(PairEvents& pairs) {
  Buffer<PairEvents::Event>& outlived = pairs.outlived();
  within_.reserve(within_.size() + outlived.size());
  for (const PairEvents::Event& touch : outlived)
    within_.push_back({touch.o1, touch.o2, touch.place, touch.number, false, true});
  outlive_ = outlive_ || outlived.size() != 0;
  outlived.resizeDiscarding(0);
}

// Leaves in next_within_ what touches in sub-spaces, in changed_ own pairs.
void TouchEvents::listTouches(const ContactPairs& contacts, const NarrowPhase& found,
                              PairEvents& pairs) {
  const Buffer<dxGeom*>& geoms = contacts.scene().slots;
  const Buffer<dParallelSAPPair>& list = contacts.list();
  const Buffer<std::size_t>& firsts = contacts.firsts();
  for (std::size_t place = 0; place < firsts.size(); ++place) {
    const std::size_t begin = firsts[place];
    const std::size_t end = place + 1 < firsts.size() ? firsts[place + 1] : list.size();
    const Pair pair = pairs.list()[place];
    const bool is_own = end == begin + 1 && list[begin].o1 == geoms[earlierOf(pair)] &&
                        list[begin].o2 == geoms[laterOf(pair)];
    if ((is_own && found.touches(begin)) != (pairs.touches()[place] != no_touch))
      changed_.push_back(static_cast<Number>(place));
    for (std::size_t i = is_own ? end : begin; i < end; ++i)
      if (found.touches(i))
        next_within_.push_back({list[i].o1, list[i].o2, place, 0, false, false});
  }
}

// Adds pairs that touch and did not: their touches may have outlived the pairs that they were.
void TouchEvents::listAgain(const Buffer<dxGeom*>& geoms, PairEvents& pairs) {
  for (const Number place : changed_) {
    if (pairs.touches()[place] != no_touch) continue;
    const Pair pair = pairs.list()[place];
    next_within_.push_back(
        {geoms[earlierOf(pair)], geoms[laterOf(pair)], place, pairs.numbers()[place], false, true});
  }
}

// Finds which touches of next_within_ last: most in the order of the last frame, others by the
// table. One that the program's callback added twice counts once. A geom without the flag is
// another one than that of its address in the last frame. Returns how many begin.
std::size_t TouchEvents::match() {
  for (Within& touch : within_) touch.lasts = false;
  table_.resizeDiscarding(0);
  again_.resizeDiscarding(0);
  const std::size_t last = within_.size();
  std::size_t next = 0, kept = 0, begun = 0;
  for (Within touch : next_within_) {
    const bool is_known = (touch.o1->gflags & touch.o2->gflags & touching_) != 0;
    const auto isSame = [&](const Within& before) {
      return is_known && before.isOf(touch.o1, touch.o2) && before.outlives == touch.outlives;
    };
    if (next == last || !isSame(within_[next])) {
      std::uint32_t& entry = entryOf(touch.o1, touch.o2);
      if (entry > last) continue;
      if (entry == 0 || !isSame(within_[entry - 1])) {
        if (touch.outlives) continue;
        ++begun;
        next_within_[kept++] = touch;
        entry = static_cast<std::uint32_t>(last + kept);
        continue;
      }
      next = entry - 1;
    }
    Within& before = within_[next++];
    if (before.lasts) continue;
    if (touch.outlives) again_.push_back(static_cast<Number>(touch.place));
    before.lasts = touch.lasts = true;
    touch.number = before.number;
    next_within_[kept++] = touch;
  }
  next_within_.resize(kept);
  return begun;
}

// The entry of the touch of two geoms, in any order, or a free one. Entries count from 1, first the
// touches of the last frame, then those that begin in this one.
std::uint32_t& TouchEvents::entryOf(const dxGeom* o1, const dxGeom* o2) {
  const auto bits = [](const dxGeom* geom) { return reinterpret_cast<std::uintptr_t>(geom); };
  const std::size_t last = within_.size();
  const auto find = [&](const dxGeom* a, const dxGeom* b) -> std::uint32_t& {
    for (std::size_t at = hashOf(bits(a) ^ bits(b)) + bits(a) + bits(b);; ++at) {
      std::uint32_t& entry = table_[at & (table_.size() - 1)];
      if (entry == 0) return entry;
      const Within& touch = entry <= last ? within_[entry - 1] : next_within_[entry - 1 - last];
      if (touch.isOf(a, b)) return entry;
    }
  };
  if (table_.size() == 0) {
    std::size_t size = 1;
    while (size <= last + next_within_.size()) size *= 2;
    table_.resizeDiscarding(size);
    std::fill(table_.begin(), table_.end(), 0);
    for (std::uint32_t i = 0; i < last; ++i) find(within_[i].o1, within_[i].o2) = i + 1;
  }
  return find(o1, o2);
}

// Of touches that did not last: which geoms are still there; no other is read. Those whose pair
// rests last after all. Returns how many end.
std::size_t TouchEvents::findEnded(const Buffer<dxGeom*>& geoms, const PairRules& rules) {
  std::size_t ended = static_cast<std::size_t>(
      std::count_if(within_.begin(), within_.end(), [](const Within& t) { return !t.lasts; }));
  if (ended == 0) return 0;
  left_.resizeDiscarding(0);
  for (const Within& touch : within_)
    if (!touch.lasts)
      for (const dxGeom* const geom : {touch.o1, touch.o2})
        left_.push_back(reinterpret_cast<std::uintptr_t>(geom));
  std::sort(left_.begin(), left_.end());
  left_.resize(std::unique(left_.begin(), left_.end()) - left_.begin());
  for (dxGeom* const geom : geoms)
    if (geom) markPresent(geom);
  for (Within& touch : within_) {
    if (touch.lasts || !touch.outlives || !ifPresent(touch.o1) || !ifPresent(touch.o2) ||
        !PairEvents::rests(touch.o1, touch.o2, rules))
      continue;
    touch.lasts = true;
    --ended;
    next_within_.push_back(touch);
  }
  return ended;
}

void TouchEvents::markPresent(dxGeom* geom) {
  if (IS_SPACE(geom)) {
    for (dxGeom* own = static_cast<dxSpace*>(geom)->first; own; own = own->next) markPresent(own);
  } else if (geom->gflags & touching_) {
    if (std::uintptr_t* const left = findLeft(geom)) *left |= present;
  }
}

// Where a geom is in left_, or null.
std::uintptr_t* TouchEvents::findLeft(const dxGeom* geom) {
  const std::uintptr_t bits = reinterpret_cast<std::uintptr_t>(geom);
  std::uintptr_t* const left = std::lower_bound(left_.begin(), left_.end(), bits);
  return left < left_.end() && (*left & ~present) == bits ? left : nullptr;
}

// There is room for all events and numbers.
void TouchEvents::writeOwn(const Buffer<dxGeom*>& geoms, PairEvents& pairs, int threads) {
  Touch* const touches = pairs.touches();
  const Number* again = again_.begin();
  for (const Number place : changed_) {
    if (again < again_.end() && *again == place) {
      ++again;  // it outlived its pair
      continue;
    }
    const Number number = pairs.numbers()[place];
    const Pair pair = pairs.list()[place];
    dxGeom *const o1 = geoms[earlierOf(pair)], *const o2 = geoms[laterOf(pair)];
    if (touches[place] != no_touch) {
      ended_.push_back({o1, o2, touches[place], number});
      touches[place] = no_touch;
    } else {
      begun_.push_back({o1, o2, place, number});
      touches[place] = place;
    }
  }
  const int team = teamFor(pairs.pairs(), grains::moved_pairs, threads);
  runChunks(noting, team, pairs.pairs(), chunkOf(pairs.pairs(), chunk_pairs, team),
            [&](const Range& range, int) {
              for (std::size_t place = range.begin; place < range.end; ++place)
                touches[place] = touches[place] == no_touch ? no_touch : static_cast<Touch>(place);
            });
  for (const PairEvents::Event& touch : pairs.endedTouches()) ended_.push_back(touch);
  pairs.endedTouches().resizeDiscarding(0);
}

void TouchEvents::writeWithin(PairNumbers& pool) {
  for (const Within& touch : within_)
    if (!touch.lasts)
      ended_.push_back({ifPresent(touch.o1), ifPresent(touch.o2), touch.place, touch.number});
  outlive_ = false;
  for (Within& touch : next_within_) {
    outlive_ = outlive_ || touch.outlives;
    if (touch.lasts) continue;
    touch.number = pool.take();
    begun_.push_back({touch.o1, touch.o2, touch.place, touch.number});
    touch.o1->gflags |= touching_;
    touch.o2->gflags |= touching_;
  }
  std::swap(within_, next_within_);
}

void TouchEvents::release() {
  begun_.release();
  ended_.release();
  again_.release();
  changed_.release();
  table_.release();
  left_.release();
}

}  // namespace ode_parallel_sap
