#include "driver.h"

#include <cstdarg>
#include <cstdio>
#include <cstdlib>

namespace sap_test {
namespace {

void ignoreMessage(int, const char*, va_list) {}

[[noreturn]] void endInAssertion(int, const char* format, va_list arguments) {
  std::fputs("an assertion of ODE's: ", stderr);
  std::vfprintf(stderr, format, arguments);
  std::fputs("\n", stderr);
  std::abort();
}

}  // namespace

Driver::Driver(Decisions& decisions, std::size_t most_geoms, const Configuration* configuration,
               bool makes_tests)
    : decisions_(decisions),
      most_geoms_(most_geoms),
      configuration_(configuration),
      makes_tests_(makes_tests),
      messages_(dGetMessageHandler()),
      debugs_(dGetDebugHandler()),
      errors_(dGetErrorHandler()),
      world_(dWorldCreate()) {
  dSetMessageHandler(ignoreMessage);
  dSetDebugHandler(endInAssertion);
  dSetErrorHandler(endInAssertion);
  dWorldSetAutoDisableFlag(world_, decisions_.chance(128));
  dWorldSetAutoDisableSteps(world_, 1);
  dWorldSetAutoDisableTime(world_, 0);
  createSpace();
  populate();
}

Driver::~Driver() {
  static auto& kept = *new std::vector<std::pair<dWorldID, std::vector<Object>>>;
  if (!locked_.empty()) {
    kept.emplace_back(world_, std::move(objects_));
    spaces_.clear();
    alive_.clear();
  }
  while (!spaces_.empty()) {
    int root = spaces_[0];
    while (objects_[root].parent != kNone) root = objects_[root].parent;
    destroy(root);
  }
  while (!alive_.empty()) destroy(alive_.back());
  if (locked_.empty()) dWorldDestroy(world_);
  dSetMessageHandler(messages_);
  dSetDebugHandler(debugs_);
  dSetErrorHandler(errors_);
}

void Driver::step(bool collides) {
  // The edits come first. What comes more than once is done more often.
  constexpr std::size_t kNumEdits = 11;
  constexpr void (Driver::*kSteps[])() = {
      &Driver::populate,        &Driver::createOne,        &Driver::createSpace,
      &Driver::destroySpace,    &Driver::moveFar,          &Driver::changeBodies,
      &Driver::destroyBodies,   &Driver::moveToOtherSpace, &Driver::cleanSpace,
      &Driver::changeSettings,  &Driver::stepWorld,        &Driver::collideFrames,
      &Driver::collideFrames,   &Driver::collideFrames,    &Driver::collideFrames,
      &Driver::collideFrames,   &Driver::collideFrames,    &Driver::collideAnyhow,
      &Driver::collideAnyhow,   &Driver::collideAnyhow,    &Driver::collideAnyhow,
      &Driver::collideWithGeom, &Driver::collideWithMany,  &Driver::collideContacts,
      &Driver::collideBlocks,   &Driver::askBatches,       &Driver::askBatches};
  const std::size_t what =
      decisions_.below(kNumChanges + (collides ? std::size(kSteps) : kNumEdits));
  if (what < kNumChanges)
    changeSome(kChanges[what]);
  else
    (this->*kSteps[what - kNumChanges])();
}

void Driver::finish() {
  const std::vector<int> all = spaces_;
  for (const int space : all) collidePlain(space);
}

int Driver::pickSpace() {
  return spaces_[decisions_.below(spaces_.size())];
}

int Driver::pickOurSpace() {
  const std::size_t start = decisions_.below(spaces_.size());
  for (std::size_t i = 0; i < spaces_.size(); ++i) {
    const int space = spaces_[(start + i) % spaces_.size()];
    if (objects_[space].ours) return space;
  }
  return spaces_[0];  // the first one is ours
}

int Driver::pickMember(int space, Random& random) const {
  const std::vector<int>& members = objects_[space].members;
  return members.empty() ? kNone : members[random.below(members.size())];
}

std::vector<int> Driver::pickSome(int space, Random& random) {
  const double parts[] = {0, 0.001, 0.01, 0.1, 0.5, 1};
  const double part = parts[decisions_.below(std::size(parts))];
  std::vector<int> some;
  if (part == 0) {
    const int one = pickMember(space, random);
    if (one != kNone) some.push_back(one);
    return some;
  }
  for (const int member : objects_[space].members) {
    if (random.chance(part)) some.push_back(member);
  }
  return some;
}

bool Driver::isInside(int object, int space) const {
  for (; object != kNone; object = objects_[object].parent) {
    if (object == space) return true;
  }
  return false;
}

std::vector<int> Driver::within(int space) const {
  std::vector<int> all;
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (objects_[i].geom && isInside(objects_[i].parent, space)) all.push_back(static_cast<int>(i));
  return all;
}

// Of a region in which the geoms there are overlap a few others each.
double Driver::side() const {
  return 1 + std::cbrt(static_cast<double>(alive_.size()));
}

void Driver::log(const std::string& call) {
  history_.push_back(std::to_string(++calls_) + ": " + call);
  if (history_.size() > 40) history_.pop_front();
  ++changes_;
}

void Driver::fail(const std::string& what) {
  if (!problem_.empty()) return;
  for (const std::string& call : history_) problem_ += call + "\n";
  problem_ += what + "\n";
}

}  // namespace sap_test
