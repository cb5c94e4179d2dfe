#include "space/trace/trace.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <limits>
#include <new>

#include "space/base/platform.h"
#include "space/ode/environment.h"

namespace ode_parallel_sap {

namespace {

constexpr std::uint32_t none = 0;

// Three rows of three: ODE's have a fourth number, which says nothing.
void copyPose(const dReal* position, const dReal* rotation, dReal (&pose)[trace_format::pose]) {
  for (int i = 0; i < 3; ++i) pose[i] = position[i];
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose[3 + 3 * row + column] = rotation[4 * row + column];
}

// The numbers that make a shape, of the classes that can be made again.
void copyParams(dGeomID geom, dReal (&params)[trace_format::params]) {
  switch (geom->type) {
    case dSphereClass:
      params[0] = dGeomSphereGetRadius(geom);
      break;
    case dBoxClass:
      return dGeomBoxGetLengths(geom, params);
    case dCapsuleClass:
      return dGeomCapsuleGetParams(geom, params, params + 1);
    case dCylinderClass:
      return dGeomCylinderGetParams(geom, params, params + 1);
    case dPlaneClass:
      return dGeomPlaneGetParams(geom, params);
    case dRayClass:
      params[0] = dGeomRayGetLength(geom);
      // Forks of ODE have other functions for these.
      if (geom->gflags & RAY_FIRSTCONTACT) params[1] += 1;
      if (geom->gflags & RAY_BACKFACECULL) params[1] += 2;
      if (geom->gflags & RAY_CLOSEST_HIT) params[1] += 4;
      break;
    default:
      break;
  }
}

// Of a geom that is up to date; its number, its parent's and its body's are the caller's.
GeomRecord recordOf(const dxGeom* geom) {
  GeomRecord record = {};
  record.traits.geom_class = static_cast<std::uint32_t>(geom->type);
  std::uint32_t& flags = record.traits.flags;
  if (geom->gflags & GEOM_ENABLED) flags |= trace_format::enabled;
  if (geom->gflags & GEOM_ZERO_SIZED) flags |= trace_format::zero_sized;
  if (geom->gflags & GEOM_PLACEABLE) flags |= trace_format::placeable;
  if (geom->offset_posr) flags |= trace_format::offset;
  if (IS_SPACE(geom)) flags |= trace_format::space;
  record.traits.category_bits = geom->category_bits;
  record.traits.collide_bits = geom->collide_bits;
  copyParams(const_cast<dGeomID>(geom), record.traits.params);
  // That of a geom without an offset, on a body, is the body's.
  if (geom->offset_posr)
    copyPose(geom->offset_posr->pos, geom->offset_posr->R, record.pose);
  else if ((geom->gflags & GEOM_PLACEABLE) && !geom->body)
    copyPose(geom->final_posr->pos, geom->final_posr->R, record.pose);
  for (int i = 0; i < trace_format::bounds; ++i) record.bounds[i] = geom->aabb[i];
  return record;
}

BodyRecord recordOf(dBodyID body) {
  BodyRecord record = {};
  record.flags = (dBodyIsEnabled(body) ? trace_format::awake : 0u) |
                 (dBodyIsKinematic(body) ? trace_format::kinematic : 0u);
  copyPose(dBodyGetPosition(body), dBodyGetRotation(body), record.pose);
  return record;
}

template <class Record>
bool same(const Record& a, const Record& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

// That of the process which loaded the library, so not of one that was forked from it.
const long first_process = processNumber();

// Files that were made with a first frame.
std::atomic<int> files_begun{0};

std::uint64_t checksumOf(const TraceBytes& head, const TraceBytes& contents) {
  std::uint64_t checksum = trace_format::checksum_begin, word = 0;
  for (const TraceBytes* bytes : {&head, &contents})
    for (std::size_t i = 0; i < bytes->size(); i += sizeof word) {
      std::memcpy(&word, bytes->data() + i, sizeof word);
      checksum = trace_format::addToChecksum(checksum, word);
    }
  return checksum;
}

// "e": programs that this one starts do not get the file.
#if defined(__GLIBC__)
constexpr char write_mode[] = "wbe";  // fixed: the C library's
#else
constexpr char write_mode[] = "wb";  // fixed: the C library's
#endif

}  // namespace

void TraceChanges::write(const Scene& scene, TraceBytes& bytes) {
  ++frame_;
  for (TraceBytes& list : lists_) list.clear();
  gone_.clear();
  for (const dxGeom* const geom : scene.slots)
    if (geom) visit(geom, 0);
  // What is not there any more: another one may come to its address.
  const auto drop = [this](auto& map, auto note) {
    for (auto entry = map.begin(); entry != map.end();) {
      const bool stays = entry->second.frame == frame_;
      if (!stays) note(entry->second.record);
      entry = stays ? std::next(entry) : map.erase(entry);
    }
  };
  drop(geoms_, [this](const GeomRecord& geom) { gone_.push_back(geom.traits.number); });
  drop(bodies_, [](const BodyRecord&) {});
  std::sort(gone_.begin(), gone_.end());
  for (const std::uint32_t number : gone_) put(lists_[removed], number);
  constexpr std::size_t bounds_entry = 8 + sizeof GeomRecord::bounds;
  constexpr std::size_t entry[lists] = {sizeof gone_[0], sizeof(BodyRecord), sizeof(GeomRecord),
                                        bounds_entry + sizeof GeomRecord::pose, bounds_entry};
  for (int list = 0; list < lists; ++list)
    put(bytes, static_cast<std::uint32_t>(lists_[list].size() / entry[list]));
  put(bytes, none);
  pad(lists_[removed]);
  for (const TraceBytes& list : lists_) bytes += list;
}

void TraceChanges::visit(const dxGeom* geom, std::uint32_t parent) {
  Seen<GeomRecord>& known = geoms_[geom];
  // Its number is another one's, or from when it was in a sub-space.
  if (known.has_left || (parent == 0 && known.record.traits.parent != 0)) {
    gone_.push_back(known.record.traits.number);
    known = {};
  }
  known.frame = frame_;
  GeomRecord now = recordOf(geom);
  const std::uint32_t last_number = known.record.traits.number;
  now.traits.number = last_number ? last_number : ++last_geom_;
  now.traits.parent = parent;
  now.traits.body = visit(geom->body);
  if (!same(now.traits, known.record.traits))
    put(lists_[changed_geoms], now);
  else if (!same(now.pose, known.record.pose))
    put(lists_[poses], now.traits.number, none, now.pose, now.bounds);
  else if (!same(now.bounds, known.record.bounds))
    put(lists_[bounds], now.traits.number, none, now.bounds);
  known.record = now;
  if (!IS_SPACE(geom)) return;
  for (const dxGeom* own = static_cast<const dxSpace*>(geom)->first; own; own = own->next)
    visit(own, now.traits.number);
}

// Writes a body that is new or has changed; 0 for none.
std::uint32_t TraceChanges::visit(dBodyID body) {
  if (!body) return 0;
  Seen<BodyRecord>& known = bodies_[body];
  if (known.frame == frame_) return known.record.number;
  known.frame = frame_;
  BodyRecord now = recordOf(body);
  now.number = known.record.number ? known.record.number : ++last_body_;
  if (!same(now, known.record)) put(lists_[changed_bodies], now);
  known.record = now;
  return now.number;
}

bool Trace::open(const std::string& path) {
  later_.clear();
  process_ = processNumber();
  path_ = path;
  whole_ = 0;
  errno = ENOTSUP;
  // Records are written as they lie in memory.
  if (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) file_.reset(std::fopen(path.c_str(), write_mode));
  if (!file_) {
    dMessage(0, "parallel SAP space: the trace %s cannot be written: %s", path.c_str(),
             std::strerror(errno));
    return false;
  }
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  head_.assign(trace_format::magic, trace_format::tag_bytes);
  if (!add(head_)) return false;
  whole_ = head_.size();
  bytes_.clear();
  const std::string ode = dGetConfiguration();
  put(bytes_, trace_format::version, trace_format::byte_order, std::uint32_t{sizeof(dReal)}, every_,
      static_cast<std::uint32_t>(ode.size()));
  bytes_ += ode;
  write(trace_format::header_tag);
  return file_ != nullptr;
}

void Trace::write(const char (&tag)[9]) {
  if (!file_) return;
  pad(bytes_);
  head_.assign(tag, trace_format::tag_bytes);
  put(head_, std::uint64_t{bytes_.size()});
  put(head_, checksumOf(head_, bytes_));
  if (add(head_) && add(bytes_)) whole_ += head_.size() + bytes_.size();
}

// Nothing is buffered, so that the chunks of a program that crashes are in the file.
bool Trace::add(const TraceBytes& bytes) {
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size()) return true;
  giveUp(std::strerror(errno));
  return false;
}

// Cuts the file itself, since another one may have its name by now. A pipe cannot be cut.
void Trace::giveUp(const char* why) {
  if (!file_) return;
  dMessage(0, "parallel SAP space: the trace %s ends here: %s", path_.c_str(), why);
  (void)!ftruncate(fileno(file_.get()), static_cast<off_t>(whole_));
  file_.reset();
}

bool Trace::openNamed() {
  if (processNumber() != first_process && later_.find("%p") == std::string::npos) {
    later_.clear();
    return false;
  }
  std::string name = later_;
  const std::string number = std::to_string(processNumber());
  for (std::size_t at = 0; (at = name.find("%p", at)) != std::string::npos; at += number.size())
    name.replace(at, 2, number);
  const int files = files_begun.fetch_add(1) + 1;
  return open(files == 1 ? name : name + "." + std::to_string(files));
}

bool Trace::wantsScene() {
  wants_pairs_ = false;
  const bool due = frames_++ % static_cast<std::uint64_t>(every_) == 0;
  return due && every() != 0;
}

void Trace::seeScene(const Scene& scene, const PairRules& rules) try {
  if (!later_.empty() && !openNamed()) return;
  // After a fork both processes have the file; it is the first one's.
  if (process_ != processNumber()) return;
  bytes_.clear();
  const std::uint32_t options = (rules.skip_static ? trace_format::skip_static : 0u) |
                                (rules.skip_asleep ? trace_format::skip_asleep : 0u) |
                                (rules.cull_planes ? trace_format::cull_planes : 0u);
  put(bytes_, frames_, options, std::uint32_t{0}, static_cast<double>(rules.tolerance));
  changes_.write(scene, bytes_);
  write(trace_format::frame_tag);
  wants_pairs_ = rules.tolerance == 0;  // else they depend on the frames before
} catch (const std::bad_alloc&) {
  later_.clear();
  giveUp("out of memory");
}

bool Trace::isDue() {
  pairs_ = sum_ = 0;
  return std::exchange(wants_pairs_, false);
}

void Trace::see(dGeomID a, dGeomID b) {
  ++pairs_;
  sum_ += trace_format::pairSum(changes_.numberOf(a), changes_.numberOf(b));
}

void Trace::endPairs() try {
  if (process_ != processNumber()) return;
  bytes_.clear();
  put(bytes_, frames_, pairs_, sum_);
  write(trace_format::pairs_tag);
} catch (const std::bad_alloc&) {
  giveUp("out of memory");
}

// path[:every]. A colon that no number follows is part of the path.
std::unique_ptr<Trace> Trace::fromEnvironment() {
  const char* const text = std::getenv("ODE_PARALLEL_SAP_TRACE");
  if (!text || !*text) return nullptr;
  const char* const colon = std::strrchr(text, ':');
  const bool numbered = colon && colon[1] && !colon[1 + std::strspn(colon + 1, "0123456789")];
  std::string path = numbered ? std::string(text, colon) : text;
  const long number = numbered ? std::strtol(colon + 1, nullptr, 10) : 1;
  const int every = static_cast<int>(std::min<long>(number, std::numeric_limits<int>::max()));
  if (every < 1 || path.empty()) {
    complainOnce(std::string("ODE_PARALLEL_SAP_TRACE=") + text +
                 " is not a path[:every] and is ignored");
    return nullptr;
  }
  return std::make_unique<Trace>(every, std::move(path));
}

}  // namespace ode_parallel_sap
