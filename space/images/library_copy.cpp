#include "space/images/library_copy.h"

#include <dlfcn.h>
#include <link.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <utility>

namespace ode_parallel_sap {

namespace {

struct Search {
  std::uintptr_t address;
  LoadedLibrary found;
};

int compareLibrary(dl_phdr_info* info, std::size_t, void* data) {
  Search& search = *static_cast<Search*>(data);
  LoadedLibrary library;
  library.base = info->dlpi_addr;
  library.path = info->dlpi_name;
  bool holds = false;
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const ElfW(Phdr)& header = info->dlpi_phdr[i];
    if (header.p_type != PT_LOAD) continue;
    const std::uintptr_t begin = library.base + header.p_vaddr;
    library.segments.push_back({begin, begin + header.p_memsz, (header.p_flags & PF_W) != 0});
    holds = holds || library.segments.back().holds(search.address);
  }
  if (holds) search.found = std::move(library);
  return holds;
}

bool readFile(const std::string& path, std::vector<char>& bytes) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return false;
  bytes.resize(static_cast<std::size_t>(file.tellg()));
  file.seekg(0);
  return bool(file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())));
}

// An ELF file in memory.
class ElfFile {
 public:
  explicit ElfFile(std::vector<char>& bytes) : bytes_(bytes) {
    const auto* const header = at<ElfW(Ehdr)>(0, 1);
    if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0) return;
    segments_ = at<ElfW(Phdr)>(header->e_phoff, header->e_phnum);
    if (segments_) end_ = segments_ + header->e_phnum;
  }

  // Makes DT_SYMBOLIC of the DT_SONAME, if that begins with `name`.
  bool makeSymbolic(const char* name) {
    const ElfW(Phdr)* dynamic = segments_;
    while (dynamic != end_ && dynamic->p_type != PT_DYNAMIC) ++dynamic;
    if (dynamic == end_) return false;
    const std::size_t count = dynamic->p_filesz / sizeof(ElfW(Dyn));
    ElfW(Dyn)* const entries = at<ElfW(Dyn)>(dynamic->p_offset, count);
    if (!entries) return false;
    ElfW(Dyn)* soname = nullptr;
    std::uint64_t strings = 0;
    for (std::size_t i = 0; i < count && entries[i].d_tag != DT_NULL; ++i) {
      if (entries[i].d_tag == DT_SONAME) soname = &entries[i];
      if (entries[i].d_tag == DT_STRTAB) strings = entries[i].d_un.d_ptr;
    }
    if (!soname || !begins(strings + soname->d_un.d_val, name)) return false;
    soname->d_tag = DT_SYMBOLIC;
    return true;
  }

 private:
  template <class T>
  T* at(std::uint64_t offset, std::uint64_t count) {
    if (offset > bytes_.size() || count > (bytes_.size() - offset) / sizeof(T)) return nullptr;
    return reinterpret_cast<T*>(bytes_.data() + offset);
  }

  // Whether the text at this address of the loaded file begins with `name`.
  bool begins(std::uint64_t address, const char* name) {
    const std::size_t length = std::strlen(name);
    for (const ElfW(Phdr)* s = segments_; s != end_; ++s) {
      if (s->p_type != PT_LOAD || address < s->p_vaddr || address - s->p_vaddr >= s->p_filesz)
        continue;
      const char* const text = at<char>(s->p_offset + (address - s->p_vaddr), length);
      return text && std::strncmp(text, name, length) == 0;
    }
    return false;
  }

  std::vector<char>& bytes_;
  const ElfW(Phdr) * segments_ = nullptr, *end_ = nullptr;
};

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// A file in memory that holds these bytes; null where there is no room for it.
File fileOf(const std::vector<char>& bytes) {
  constexpr unsigned close_on_exec = 1;  // fixed: MFD_CLOEXEC
  constexpr unsigned executable = 16;    // fixed: MFD_EXEC, of Linux 6.3, where files may need it
  if (copyFails("memory")) return nullptr;
  long number = syscall(SYS_memfd_create, "ode-image", close_on_exec | executable);
  if (number < 0) number = syscall(SYS_memfd_create, "ode-image", close_on_exec);
  File file(number < 0 ? nullptr : fdopen(static_cast<int>(number), "wb"));
  const bool whole = file && std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  return whole && std::fflush(file.get()) == 0 ? std::move(file) : nullptr;
}

// The dynamic linker takes two files of one name for one, and numbers of files come back when they
// are closed: each copy is named by a path with a few slashes more.
std::string nameOf(std::FILE* file) {
  static std::atomic<unsigned> copies{0};
  return "/proc/self/fd" + std::string(1 + copies.fetch_add(1), '/') + std::to_string(fileno(file));
}

// The same bytes wherever nothing is written: code and constants.
bool sameContents(const LoadedLibrary& a, const LoadedLibrary& b) {
  if (a.segments.size() != b.segments.size() || copyFails("contents")) return false;
  for (std::size_t i = 0; i < a.segments.size(); ++i) {
    const Segment &s = a.segments[i], &t = b.segments[i];
    if (s.begin - a.base != t.begin - b.base || s.end - s.begin != t.end - t.begin ||
        s.writable != t.writable)
      return false;
    if (!s.writable && std::memcmp(reinterpret_cast<const void*>(s.begin),
                                   reinterpret_cast<const void*>(t.begin), s.end - s.begin) != 0)
      return false;
  }
  return true;
}

}  // namespace

bool copyFails(const char* part) {
  const char* const fault = std::getenv("ODE_PARALLEL_SAP_TEST_IMAGE_FAULT");
  return fault && std::strcmp(fault, part) == 0;
}

LoadedLibrary libraryAt(const void* address) {
  Search search = {reinterpret_cast<std::uintptr_t>(address), {}};
  dl_iterate_phdr(compareLibrary, &search);
  return std::move(search.found);
}

const char* LibraryCopy::load(const LoadedLibrary& original, const char* name) {
  if (original.segments.empty() || original.path.empty() || copyFails("static"))
    return "ODE is not a shared library here";
  std::vector<char> bytes;
  if (copyFails("file") || !readFile(original.path, bytes))
    return "the file of ODE's library cannot be read";
  if (!ElfFile(bytes).makeSymbolic(name)) return "ODE is part of another library";
  if (copyFails("load")) bytes[EI_CLASS] = ELFCLASSNONE;
  const File file = fileOf(bytes);
  if (!file) return "this system has no room for files in memory";
  handle_ = dlopen(nameOf(file.get()).c_str(), RTLD_NOW | RTLD_LOCAL);
  link_map* map = nullptr;
  if (!handle_ || dlinfo(handle_, RTLD_DI_LINKMAP, &map) != 0)
    return "a copy of ODE's library cannot be loaded";
  library_ = libraryAt(map->l_ld);
  if (library_.base == original.base || !sameContents(original, library_))
    return "ODE's library is not what its file holds";
  return nullptr;
}

void* LibraryCopy::symbol(const char* name) const {
  return handle_ ? dlsym(handle_, name) : nullptr;
}

}  // namespace ode_parallel_sap
