#include "player.h"

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstdlib>
#include <fstream>

#include "replayed_shapes.h"

namespace trace {

Recording readRecording(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return readRecording(file, path);
}

Recording readRecording(std::istream& file, const std::string& name) {
  // The spaces of who replays it would write over the file, if that is what the environment says.
  unsetenv("ODE_PARALLEL_SAP_TRACE");
  Recording recording;
  recording.name = name;
  Reader reader(file, name);
  recording.header = reader.header();
  for (Frame frame; reader.next(frame);) recording.frames.push_back(std::move(frame));
  if (recording.frames.empty()) throw BadTrace(name + ": it has no frame");
  // Once to see which geoms get other bounding boxes here.
  std::set<std::uint32_t> others;
  const dSpaceID space = dSimpleSpaceCreate(nullptr);
  try {
    Player player(recording, space);
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
      player.advance();
      for (const std::uint32_t number : player.otherBounds()) others.insert(number);
    }
  } catch (...) {
    dSpaceDestroy(space);
    throw;
  }
  dSpaceDestroy(space);
  recording.by_bounds = others;
  return recording;
}

Player::Player(const Recording& recording, dSpaceID space)
    : recording_(recording),
      space_(space),
      world_(dWorldCreate()),
      shown_(recording.frames.size()) {}

Player::~Player() {
  clear();
  dWorldDestroy(world_);
}

void Player::clear() {
  // The last one first, which every space is quick at.
  std::set<std::uint32_t> numbers;
  for (const auto& part : parts_) numbers.insert(part.first);
  for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) remove(*number);
  for (const auto& body : bodies_) dBodyDestroy(body.second);
  bodies_.clear();
  shown_ = recording_.frames.size();
}

const Frame& Player::advance() {
  const std::size_t next = shown_ + 1 < recording_.frames.size() ? shown_ + 1 : 0;
  if (next == 0) clear();
  shown_ = next;
  show(frame());
  return frame();
}

void Player::show(const Frame& frame) {
  for (const std::uint32_t number : frame.removed) {
    partOf(number);
    remove(number);
  }
  for (const Body& body : frame.bodies) showBody(body);
  for (const Geom& record : frame.geoms) showGeom(record);
  for (const Geom& record : frame.poses) {
    Part& part = partOf(record.number);
    part.record.pose = record.pose;
    part.record.bounds = record.bounds;
    place(part);
  }
  for (const Geom& record : frame.bounds) {
    Part& part = partOf(record.number);
    part.record.bounds = record.bounds;
    if (part.kind == by_bounds) place(part);
  }
  for (const auto& part : parts_)
    if (!part.second.in) fail("a geom is in a space that is gone");
}

void Player::showBody(const Body& body) {
  dBodyID& own = bodies_[body.number];
  if (!own) own = dBodyCreate(world_);
  setBodyPose(own, body.pose);
  if (body.flags & format::awake)
    dBodyEnable(own);
  else
    dBodyDisable(own);
  if (body.flags & format::kinematic) dBodySetKinematic(own);
}

int Player::kindOf(const Geom& record) const {
  if (record.is(format::space)) return a_space;
  if (!hasSize(record) || recording_.by_bounds.count(record.number)) return by_bounds;
  return static_cast<int>(record.geom_class);
}

void Player::showGeom(const Geom& record) {
  if (record.number == 0) fail("a geom has no number");
  const int kind = kindOf(record);
  const auto known = parts_.find(record.number);
  if (known != parts_.end() && known->second.kind != kind) remove(record.number);
  Part& part = parts_[record.number];
  part.record = record;
  if (part.geom) {
    resizeShape(part.geom, kind, record);
  } else {
    part.kind = kind;
    part.geom = makeShape(kind, record);
    dGeomSetData(part.geom, reinterpret_cast<void*>(std::uintptr_t(record.number)));
  }
  putIntoSpace(part);
  putOnBody(part);
  place(part);
  dGeomSetCategoryBits(part.geom, record.category_bits);
  dGeomSetCollideBits(part.geom, record.collide_bits);
  // ODE sees by its sizes that a shape has none.
  if (record.is(format::enabled) && !(kind == by_bounds && record.is(format::zero_sized)))
    dGeomEnable(part.geom);
  else
    dGeomDisable(part.geom);
}

void Player::putIntoSpace(Part& part) {
  dSpaceID space = space_;
  if (part.record.parent != 0) {
    const Part& parent = partOf(part.record.parent);
    if (parent.kind != a_space) fail("a geom is in one that is no space");
    for (std::uint32_t above = part.record.parent; above != 0; above = partOf(above).record.parent)
      if (above == part.record.number) fail("a space is in itself");
    space = reinterpret_cast<dSpaceID>(parent.geom);
  }
  if (space == part.in) return;
  if (part.in) dSpaceRemove(part.in, part.geom);
  dSpaceAdd(space, part.geom);
  part.in = space;
}

void Player::putOnBody(const Part& part) {
  if (!isPlaceable(part.kind)) return;
  const std::uint32_t number = part.record.body;
  const auto body = bodies_.find(number);
  if (number != 0 && body == bodies_.end()) fail("a geom is on a body that is not there");
  const dBodyID own = number ? body->second : nullptr;
  if (own == dGeomGetBody(part.geom)) return;
  // ODE forgets what it knows of an offset, but not that it is to be taken into account.
  if (dGeomIsOffset(part.geom)) dGeomClearOffset(part.geom);
  dGeomSetBody(part.geom, own);
}

void Player::place(const Part& part) {
  if (!isPlaceable(part.kind)) return;
  const dBodyID body = dGeomGetBody(part.geom);
  if (part.kind == by_bounds) {
    setBounds(part.geom, part.record.bounds);
    // Either says that it has moved.
    if (body)
      dGeomSetBody(part.geom, body);
    else
      dGeomSetPosition(part.geom, 0, 0, 0);
  } else if (!body) {
    setGeomPose(part.geom, part.record.pose);
  } else if (part.record.is(format::offset)) {
    setOffset(part.geom, part.record.pose);
  } else if (dGeomIsOffset(part.geom)) {
    dGeomClearOffset(part.geom);
  }
}

void Player::remove(std::uint32_t number) {
  const auto found = parts_.find(number);
  const Part part = found->second;
  if (part.kind == a_space) emptySpace(reinterpret_cast<dSpaceID>(part.geom));
  dGeomDestroy(part.geom);
  parts_.erase(found);
}

// What is in it may be elsewhere by the end of the frame.
void Player::emptySpace(dSpaceID space) {
  while (dSpaceGetNumGeoms(space) > 0) {
    const dGeomID geom = dSpaceGetGeom(space, 0);
    partOf(numberOf(geom)).in = nullptr;
    dSpaceRemove(space, geom);
  }
}

std::vector<std::uint32_t> Player::otherBounds() const {
  std::vector<std::uint32_t> numbers;
  for (const auto& part : parts_)
    if (part.second.kind >= 0 && !hasWrittenBounds(part.second.geom, part.second.record.bounds))
      numbers.push_back(part.first);
  return numbers;
}

Player::Part& Player::partOf(std::uint32_t number) {
  const auto found = parts_.find(number);
  if (found == parts_.end()) fail("geom " + std::to_string(number) + " is not there");
  return found->second;
}

void Player::fail(const std::string& what) const {
  throw BadTrace(recording_.name + ": frame " + std::to_string(shown_ + 1) + ": " + what);
}

void setAsTraced(dSpaceID space, const Frame& frame) {
  const auto has = [&](format::Rules rule) { return (frame.rules & rule) != 0; };
  dParallelSAPSpaceSetSkipStatic(space, has(format::skip_static));
  dParallelSAPSpaceSetSkipAsleep(space, has(format::skip_asleep));
  dParallelSAPSpaceSetCullPlanes(space, has(format::cull_planes));
  constexpr double most = 1e30;  // fixed: finite in both precisions
  const double tolerance = frame.tolerance >= 0 && frame.tolerance <= most ? frame.tolerance : 0;
  dParallelSAPSpaceSetTolerance(space, static_cast<dReal>(tolerance));
}

PairTotals collide(dSpaceID space) {
  PairTotals totals;
  dSpaceCollide(space, &totals, [](void* data, dGeomID a, dGeomID b) {
    static_cast<PairTotals*>(data)->add(Player::numberOf(a), Player::numberOf(b));
  });
  return totals;
}

}  // namespace trace
