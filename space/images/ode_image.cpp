#include "space/images/ode_image.h"

#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <new>
#include <sstream>
#include <utility>

#include "space/base/platform.h"

namespace ode_parallel_sap {

namespace {

// Whether a test has this part of loading a copy fail: "static", "file", "memory", "load",
// "contents" or "table" in ODE_PARALLEL_SAP_TEST_IMAGE_FAULT.
bool copyFails(const char* part) {
  const char* const fault = std::getenv("ODE_PARALLEL_SAP_TEST_IMAGE_FAULT");
  return fault && std::strcmp(fault, part) == 0;
}

// Makes DT_SYMBOLIC of the DT_SONAME in the bytes of a library's file.
bool makeSymbolic(const LoadedLibrary& library, std::string& bytes) {
  ElfW(Dyn) entry;
  const std::size_t end = std::min(library.dynamic_end, bytes.size());
  for (std::size_t at = library.dynamic_begin; at + sizeof entry <= end; at += sizeof entry) {
    std::memcpy(&entry, &bytes[at], sizeof entry);
    if (entry.d_tag != DT_SONAME) continue;
    entry.d_tag = DT_SYMBOLIC;
    std::memcpy(&bytes[at], &entry, sizeof entry);
    return true;
  }
  return false;
}

// The same bytes wherever nothing is written: code and constants.
bool sameContents(const LoadedLibrary& a, const LoadedLibrary& b) {
  const auto same = [&](const Segment& s, const Segment& t) {
    return s.begin - a.base == t.begin - b.base && s.end - s.begin == t.end - t.begin &&
           s.writable == t.writable &&
           (s.writable ||
            std::memcmp(reinterpret_cast<const void*>(s.begin),
                        reinterpret_cast<const void*>(t.begin), s.end - s.begin) == 0);
  };
  return !copyFails("contents") && std::equal(a.segments.begin(), a.segments.end(),
                                              b.segments.begin(), b.segments.end(), same);
}

// What the program's ODE makes of it where no function is set differs from message to error, and
// it takes a text only by an ellipsis.
template <void (*tell)(int, const char*, ...), dMessageFunction* (*programs)()>
void handOn(int number, const char* format, va_list arguments) {
  if (dMessageFunction* const function = programs()) {
    function(number, format, arguments);
    return;
  }
  char text[1000];
  std::vsnprintf(text, sizeof text, format, arguments);
  tell(number, "%s", text);
}

// The size of the first thing that an image allocates; one image is loaded by one thread.
thread_local std::size_t first_size = 0;

void* noteAllocation(std::size_t size) {
  if (first_size == 0) first_size = size;
  return std::malloc(size);
}

// A collider that stands for nothing but itself.
int mark(dGeomID, dGeomID, int, dContactGeom*, int) {
  return 0;
}

bool isHeightfield(const dxGeom* geom) {
  return geom->type == dHeightfieldClass;
}

// A function of an image by its name in ODE's headers.
#define IN_IMAGE(function) reinterpret_cast<decltype(&(function))>(symbol(#function))

// Pairs that take as long as loading an image does, 1.5 ms, at 1.5 us a pair of a box and a mesh:
// whatever comes, it has cost no more than twice what would have been best.
constexpr std::uint64_t pairs_worth_an_image = 1000;

// fixed: a bound of the process: each takes some 2 MB, most of it the file in memory.
constexpr std::size_t most_images = 64;

// How long exit() waits for collisions in other threads.
constexpr std::chrono::seconds longest_wait(2);

using Lent = std::vector<ThreadCollider*>;

// The process's images of ODE, and who has them. No two lenders have one at a time. They are loaded
// when there have been pairs enough to pay for it, and kept for the life of the process, through
// fork and exit. The first that cannot be loaded ends that; dMessage tells why, once.
class Pool {
 public:
  // Never destroyed: threads may be at work when static objects are.
  static Pool& get() {
    static Pool& pool = *new Pool;
    return pool;
  }

  // `lent` has room for them.
  void lend(std::size_t wanted, std::size_t pairs, Lent& lent) {
    std::unique_lock<std::mutex> guard(lock_);
    if (closed_) return;
    const std::size_t missing = can_load_ && wanted > free_.size()
                                    ? std::min(wanted - free_.size(), most_images - all_)
                                    : 0;
    if (missing) pairs_ += pairs;
    const char* why = nullptr;
    if (missing && pairs_ >= grained(pairs_worth_an_image) * missing) {
      pairs_ = 0;
      can_load_ = false;  // another thread meanwhile
      guard.unlock();
      why = load(missing);
      guard.lock();
      can_load_ = !why;
    }
    if (std::min(wanted, free_.size()) > 1)
      while (lent.size() < wanted && !free_.empty()) move(free_, lent);
    lent_ += lent.size();
    const std::size_t threads = std::max<std::size_t>(1, all_);
    guard.unlock();
    if (why)
      dMessage(0,
               "parallel SAP space: heightfields, and meshes where ODE has no thread-local "
               "storage, are collided by at most %zu of the threads: %s",
               threads, why);
  }

  void takeBack(Lent& lent) {
    const std::lock_guard<std::mutex> guard(lock_);
    lent_ -= std::min(lent_, lent.size());
    while (!lent.empty()) move(lent, free_);
    returned_.notify_all();
  }

 private:
  Pool() {
    onFork([] { get().lock_.lock(); }, [] { get().lock_.unlock(); }, [] { get().beginChild(); });
  }

  // The last one: a thread mostly gets the image again that is in its cache.
  static void move(Lent& from, Lent& to) {
    to.push_back(from.back());
    from.pop_back();
  }

  // Without the lock: loading takes long.
  const char* load(std::size_t count) try {
    const char* why = nullptr;
    for (; count; --count) {
      auto image = std::make_unique<OdeImage>();
      why = image->load();
      if (why) break;
      const std::lock_guard<std::mutex> guard(lock_);
      free_.reserve(all_ + 1);
      free_.push_back(image.release());
      ++all_;
    }
    // Exit runs it before it destroys what is in the images loaded so far.
    std::atexit([] { get().close(); });
    return why;
  } catch (const std::bad_alloc&) {
    return "there is no memory for it";
  }

  // Images whose threads are not there any more are left as they are.
  void beginChild() {
    lent_ = 0;
    lock_.unlock();
  }

  void close() {
    std::unique_lock<std::mutex> guard(lock_);
    closed_ = true;
    returned_.wait_for(guard, longest_wait, [this] { return lent_ == 0; });
  }

  std::mutex lock_;
  std::condition_variable returned_;
  Lent free_;  // never destroyed, with room for all
  std::size_t all_ = 0, lent_ = 0;
  std::uint64_t pairs_ = 0;
  bool can_load_ = true, closed_ = false;
};

}  // namespace

LoadedLibrary libraryAt(const void* address) {
  struct Search {
    std::uintptr_t address;
    LoadedLibrary found;
  } search = {reinterpret_cast<std::uintptr_t>(address), {}};
  const auto compare = [](dl_phdr_info* info, std::size_t, void* data) {
    Search& own = *static_cast<Search*>(data);
    LoadedLibrary library;
    library.base = info->dlpi_addr;
    library.path = info->dlpi_name;
    bool holds = false;
    for (int i = 0; i < info->dlpi_phnum; ++i) {
      const ElfW(Phdr)& header = info->dlpi_phdr[i];
      if (header.p_type == PT_DYNAMIC) {
        library.dynamic_begin = header.p_offset;
        library.dynamic_end = header.p_offset + header.p_filesz;
      }
      if (header.p_type != PT_LOAD) continue;
      const std::uintptr_t begin = library.base + header.p_vaddr, end = begin + header.p_memsz;
      library.segments.push_back({begin, end, (header.p_flags & PF_W) != 0});
      holds = holds || (own.address >= begin && own.address < end);
    }
    if (holds) own.found = std::move(library);
    return int{holds};
  };
  dl_iterate_phdr(compare, &search);
  return std::move(search.found);
}

// The text of its configuration lies in ODE's library itself, where the address of a function may
// be that of a stub in the program or of what a preloaded library has in its place.
const char* OdeImage::load() {
  const LoadedLibrary original = libraryAt(dGetConfiguration());
  program_base_ = original.base;
  if (const char* const why = loadCopy(original)) return why;
  IN_IMAGE(dSetMessageHandler)(handOn<dMessage, dGetMessageHandler>);
  IN_IMAGE(dSetErrorHandler)(handOn<dError, dGetErrorHandler>);
  IN_IMAGE(dSetDebugHandler)(handOn<dDebug, dGetDebugHandler>);
  if (!IN_IMAGE(dInitODE2)(0) ||
      !IN_IMAGE(dAllocateODEDataForThread)(static_cast<unsigned>(dAllocateMaskAll)))
    return "a copy of ODE does not begin to work";
  collide_ = IN_IMAGE(dCollide);
  own_table_ = findTable();
  if (!own_table_ || copyFails("table")) return "ODE's table of colliders is not where it was";
  const std::uintptr_t place = reinterpret_cast<std::uintptr_t>(own_table_) - library_.base;
  programs_table_ = reinterpret_cast<const Table*>(program_base_ + place);
  makeHeightfield();
  return nullptr;
}

const char* OdeImage::loadCopy(const LoadedLibrary& original) {
  const std::string name = "libode.so";
  if (original.segments.empty() || original.path.empty() || copyFails("static"))
    return "ODE is not a shared library here";
  std::ifstream in(original.path, std::ios::binary);
  std::ostringstream contents;
  if (!(contents << in.rdbuf()) || copyFails("file"))
    return "the file of ODE's library cannot be read";
  std::string bytes = contents.str();
  if (original.path.compare(original.path.rfind('/') + 1, name.size(), name) != 0 ||
      !makeSymbolic(original, bytes))
    return "ODE is part of another library";
  if (copyFails("load")) bytes[EI_CLASS] = ELFCLASSNONE;
  // The dynamic linker takes two files of one name for one, and numbers of files come back when
  // they are closed: each copy is named by a path with a few slashes more.
  static std::atomic<unsigned> copies{0};
  const int file = copyFails("memory") ? -1 : memfd_create("ode-image", MFD_CLOEXEC);
  const std::string path =
      "/proc/self/fd" + std::string(1 + copies.fetch_add(1), '/') + std::to_string(file);
  std::ofstream out(path, std::ios::binary);
  const bool written =
      out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush().good();
  if (written) handle_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  close(file);
  if (!written) return "this system has no room for files in memory";
  link_map* map = nullptr;
  if (!handle_ || dlinfo(handle_, RTLD_DI_LINKMAP, &map) != 0)
    return "a copy of ODE's library cannot be loaded";
  library_ = libraryAt(map->l_ld);
  if (library_.base == original.base || !sameContents(original, library_))
    return "ODE's library is not what its file holds";
  return nullptr;
}

// ODE does not tell where its table of colliders is, but two marks that are written into it are
// found again: no others are as far from each other.
const OdeImage::Table* OdeImage::findTable() const {
  const auto hasMarks = [](const Table& table) {
    return table[dFirstUserClass][dFirstUserClass].collider == mark &&
           table[dLastUserClass][dLastUserClass].collider == mark;
  };
  const auto set_collider = IN_IMAGE(dSetColliderOverride);
  for (const int type : {dFirstUserClass, dLastUserClass}) set_collider(type, type, mark);
  const Table* found = nullptr;
  for (const Segment& segment : library_.segments) {
    constexpr std::uintptr_t step = alignof(Table);
    std::uintptr_t at = (segment.begin + step - 1) / step * step;
    for (; segment.writable && !found && at + sizeof(Table) <= segment.end; at += step)
      if (hasMarks(*reinterpret_cast<const Table*>(at))) found = reinterpret_cast<const Table*>(at);
  }
  for (const int type : {dFirstUserClass, dLastUserClass}) set_collider(type, type, nullptr);
  return found;
}

// And learns the size of a mesh, by the memory that the image asks for when it makes one: the
// private headers of meshes would need OPCODE's.
void OdeImage::makeHeightfield() {
  static const float heights[4] = {};
  heightfield_data_ = IN_IMAGE(dGeomHeightfieldDataCreate)();
  IN_IMAGE(dGeomHeightfieldDataBuildSingle)
  (heightfield_data_, heights, 0, 1, 1, 2, 2, 1, 0, 0, 0);
  heightfield_ = IN_IMAGE(dCreateHeightfield)(nullptr, heightfield_data_, 0);
  if (!dCheckConfiguration("ODE_EXT_trimesh")) return;
  first_size = 0;
  IN_IMAGE(dSetAllocHandler)(noteAllocation);
  const dGeomID mesh = IN_IMAGE(dCreateTriMesh)(nullptr, nullptr, nullptr, nullptr, nullptr);
  IN_IMAGE(dSetAllocHandler)(nullptr);
  sizes_[dTriMeshClass] = first_size;
  IN_IMAGE(dGeomDestroy)(mesh);
}

#undef IN_IMAGE

bool OdeImage::serves(const dxGeom* a, const dxGeom* b) const {
  // The program's ODE must have a collider for these classes, and the image the same.
  const Entry &own = (*own_table_)[a->type][b->type],
              &program = (*programs_table_)[a->type][b->type];
  const auto placeIn = [](std::uintptr_t base, const Entry& entry) {
    return reinterpret_cast<std::uintptr_t>(entry.collider) - base;
  };
  if (!own.collider || !program.collider || own.reverse != program.reverse ||
      placeIn(library_.base, own) != placeIn(program_base_, program))
    return false;
  const dxGeom *const field = isHeightfield(a) ? a : b, *const other = field == a ? b : a;
  return !isHeightfield(field) ||
         (sizes_[other->type] != 0 && other->final_posr &&
          !static_cast<const dxHeightfield*>(field)->m_p_data->m_pGetHeightCallback);
}

int OdeImage::collide(dxGeom* a, dxGeom* b, int flags, dContactGeom* contacts, int skip) {
  if (!isHeightfield(a) && !isHeightfield(b)) return collide_(a, b, flags, contacts, skip);
  dxGeom *const own_a = copyOf(a), *const own_b = copyOf(b);
  const int count = collide_(own_a, own_b, flags, contacts, skip);
  for (int i = 0; i < count; ++i) {
    dContactGeom& contact =
        *reinterpret_cast<dContactGeom*>(reinterpret_cast<char*>(contacts) + i * skip);
    contact.g1 = contact.g1 == own_a ? a : b;
    contact.g2 = contact.g2 == own_a ? a : b;
  }
  return count;
}

// Makes the image's heightfield one like `original`. It keeps its buffers, and reads the pose where
// it is. What is copied of a geom begins after the pointer to its virtual functions.
dxGeom* OdeImage::heightfieldLike(const dxGeom* original) {
  constexpr std::size_t from = sizeof(void*);
  std::memcpy(reinterpret_cast<char*>(heightfield_) + from,
              reinterpret_cast<const char*>(original) + from, sizeof(dxGeom) - from);
  const dxHeightfieldData& data = *static_cast<const dxHeightfield*>(original)->m_p_data;
  std::memcpy(static_cast<void*>(heightfield_data_), &data,
              offsetof(dxHeightfieldData, m_contacts));
  return heightfield_;
}

dxGeom* OdeImage::copyOf(const dxGeom* geom) {
  if (isHeightfield(geom)) return heightfieldLike(geom);
  const std::size_t size = sizes_[geom->type];
  bytes_.resize((size + sizeof(double) - 1) / sizeof(double));
  std::memcpy(bytes_.data(), static_cast<const void*>(geom), size);
  dxGeom* const copy = reinterpret_cast<dxGeom*>(bytes_.data());
  pose_ = *geom->final_posr;
  copy->final_posr = &pose_;
  return copy;
}

ThreadColliders::ThreadColliders(int wanted, std::size_t pairs) {
  if (wanted < 2) return;
  lent_.reserve(static_cast<std::size_t>(wanted));
  Pool::get().lend(static_cast<std::size_t>(wanted), pairs, lent_);
}

ThreadColliders::~ThreadColliders() {
  if (!lent_.empty()) Pool::get().takeBack(lent_);
}

}  // namespace ode_parallel_sap
