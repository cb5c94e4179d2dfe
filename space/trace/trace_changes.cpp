#include "space/trace/trace_changes.h"

#include <algorithm>

namespace ode_parallel_sap {

// `geoms` as they are before it: null where a slot is free.
void TraceChanges::closeSlots(const Buffer<dxGeom*>& geoms) {
  for (std::size_t slot = closeGaps(geoms, slots_); slot < slots_.size(); ++slot)
    slots_[slot].traits.number = 0;
}

void TraceChanges::write(const Scene& scene, TraceBytes& bytes) {
  ++frame_;
  for (List* list : {&removed_, &body_list_, &geom_list_, &poses_, &bounds_}) list->clear();
  present_.swap(present_before_);
  present_.clear();
  slots_.resize(std::max(slots_.size(), scene.slots.size()));
  for (std::size_t slot = 0; slot < scene.slots.size(); ++slot)
    if (const dxGeom* const geom = scene.slots[slot]) visit(geom, 0, slots_[slot]);
  findRemoved();
  dropUnseen();
  for (const List* list : {&removed_, &body_list_, &geom_list_, &poses_, &bounds_})
    bytes.put32(list->count);
  bytes.put32(0);
  for (const List* list : {&removed_, &body_list_, &geom_list_, &poses_, &bounds_})
    bytes.append(list->bytes);
}

// `last`: what was written of this geom; its number is 0 if nothing was.
void TraceChanges::visit(const dxGeom* geom, std::uint32_t parent, GeomRecord& last) {
  GeomRecord now = recordOf(geom);
  now.traits.number = last.traits.number ? last.traits.number : ++last_geom_;
  now.traits.parent = parent;
  now.traits.body = numberOf(geom->body);
  present_.push_back(now.traits.number);
  compare(now, last);
  if (IS_SPACE(geom)) visitInner(static_cast<const dxSpace*>(geom), now.traits.number);
}

void TraceChanges::visitInner(const dxSpace* space, std::uint32_t number) {
  for (const dxGeom* geom = space->first; geom; geom = geom->next) {
    Inner& inner = inner_[geom];
    inner.frame = frame_;
    visit(geom, number, inner.record);
  }
}

// Writes a body that is new or has changed; 0 for none.
std::uint32_t TraceChanges::numberOf(dBodyID body) {
  if (!body) return 0;
  Body& known = bodies_[body];
  if (known.frame == frame_) return known.record.number;
  known.frame = frame_;
  BodyRecord now = recordOf(body);
  now.number = known.record.number ? known.record.number : ++last_body_;
  if (!(now == known.record)) {
    ++body_list_.count;
    now.put(body_list_.bytes);
    known.record = now;
  }
  return now.number;
}

void TraceChanges::compare(const GeomRecord& now, GeomRecord& last) {
  const auto putNumber = [&](List& list) {
    ++list.count;
    list.bytes.put32(now.traits.number);
    list.bytes.put32(0);
  };
  if (!(now.traits == last.traits)) {
    ++geom_list_.count;
    now.put(geom_list_.bytes);
  } else if (!sameReals(now.pose, last.pose)) {
    putNumber(poses_);
    poses_.bytes.putReals(now.pose, trace_format::pose);
    poses_.bytes.putReals(now.bounds, trace_format::bounds);
  } else if (!sameReals(now.bounds, last.bounds)) {
    putNumber(bounds_);
    bounds_.bytes.putReals(now.bounds, trace_format::bounds);
  } else {
    return;
  }
  last = now;
}

void TraceChanges::findRemoved() {
  std::sort(present_.begin(), present_.end());
  auto here = present_.begin();
  for (const std::uint32_t number : present_before_) {
    while (here != present_.end() && *here < number) ++here;
    if (here != present_.end() && *here == number) continue;
    ++removed_.count;
    removed_.bytes.put32(number);
  }
  if (removed_.count % 2) removed_.bytes.put32(0);
}

// What is not there any more: another one may come to its address.
void TraceChanges::dropUnseen() {
  const auto drop = [this](auto& map) {
    for (auto entry = map.begin(); entry != map.end();)
      entry = entry->second.frame == frame_ ? std::next(entry) : map.erase(entry);
  };
  drop(inner_);
  drop(bodies_);
}

}  // namespace ode_parallel_sap
