#include "space/contacts/library_copy.h"

#if defined(__linux__)

#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstring>

namespace ode_parallel_sap {

namespace {

bool faultIs(CopyFault fault) {
  return test_copy_fault.load(std::memory_order_relaxed) == fault;
}

class FileDescriptor {
 public:
  explicit FileDescriptor(int number) : number_(number) {}
  ~FileDescriptor() {
    if (number_ >= 0) close(number_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int number() const { return number_; }

 private:
  const int number_;
};

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
  const FileDescriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status;
  if (file.number() < 0 || fstat(file.number(), &status) != 0) return false;
  bytes.resize(static_cast<std::size_t>(status.st_size));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = read(file.number(), bytes.data() + done, bytes.size() - done);
    if (got <= 0) return false;
    done += static_cast<std::size_t>(got);
  }
  return true;
}

// An ELF file in memory.
class ElfFile {
 public:
  explicit ElfFile(std::vector<char>& bytes) : bytes_(bytes) {
    const auto* const header = at<ElfW(Ehdr)>(0, 1);
    if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0) return;
    segments_ = at<ElfW(Phdr)>(header->e_phoff, header->e_phnum);
    if (segments_) count_ = header->e_phnum;
  }

  // Makes DT_SYMBOLIC of the DT_SONAME, if that begins with `name`.
  bool makeSymbolic(const char* name) {
    const ElfW(Phdr)* const dynamic = segment(PT_DYNAMIC);
    if (!dynamic) return false;
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

  // Changes a byte at the end of what is loaded and never written, which nothing uses.
  void spoil() {
    std::size_t last = 0;
    for (std::size_t i = 0; i < count_; ++i)
      if (segments_[i].p_type == PT_LOAD && !(segments_[i].p_flags & PF_W))
        last = segments_[i].p_offset + segments_[i].p_filesz - 1;
    if (last && last < bytes_.size()) bytes_[last] = static_cast<char>(~bytes_[last]);
  }

 private:
  template <class T>
  T* at(std::uint64_t offset, std::uint64_t count) {
    if (offset > bytes_.size() || count > (bytes_.size() - offset) / sizeof(T)) return nullptr;
    return reinterpret_cast<T*>(bytes_.data() + offset);
  }

  const ElfW(Phdr) * segment(std::uint32_t type) const {
    for (std::size_t i = 0; i < count_; ++i)
      if (segments_[i].p_type == type) return &segments_[i];
    return nullptr;
  }

  // Whether the text at this address of the loaded file begins with `name`.
  bool begins(std::uint64_t address, const char* name) {
    const std::size_t length = std::strlen(name);
    for (std::size_t i = 0; i < count_; ++i) {
      const ElfW(Phdr)& s = segments_[i];
      if (s.p_type != PT_LOAD || address < s.p_vaddr || address - s.p_vaddr >= s.p_filesz) continue;
      const char* const text = at<char>(s.p_offset + (address - s.p_vaddr), length);
      return text && std::strncmp(text, name, length) == 0;
    }
    return false;
  }

  std::vector<char>& bytes_;
  const ElfW(Phdr) * segments_ = nullptr;
  std::size_t count_ = 0;
};

int fileInMemory() {
  if (faultIs(CopyFault::Memory)) return -1;
  constexpr unsigned close_on_exec = 1;  // fixed: MFD_CLOEXEC
  constexpr unsigned executable = 16;    // fixed: MFD_EXEC, of Linux 6.3, where files may need it
  const auto create = [](unsigned flags) {
    return static_cast<int>(syscall(SYS_memfd_create, "ode-image", flags));
  };
  const int file = create(close_on_exec | executable);
  return file >= 0 ? file : create(close_on_exec);
}

bool writeFile(int file, const std::vector<char>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = write(file, bytes.data() + done, bytes.size() - done);
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

// The dynamic linker takes two files of one name for one, and numbers of files come back when they
// are closed: each copy is named by a path with a few slashes more.
std::string nameOf(int file) {
  static std::atomic<unsigned> copies{0};
  return "/proc/self/fd" + std::string(1 + copies.fetch_add(1), '/') + std::to_string(file);
}

// The same bytes wherever nothing is written: code and constants.
bool sameContents(const LoadedLibrary& a, const LoadedLibrary& b) {
  if (a.segments.size() != b.segments.size()) return false;
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

LoadedLibrary libraryAt(const void* address) {
  Search search = {reinterpret_cast<std::uintptr_t>(address), {}};
  dl_iterate_phdr(compareLibrary, &search);
  return std::move(search.found);
}

const char* LibraryCopy::load(const LoadedLibrary& original, const char* name) {
  if (original.segments.empty() || original.path.empty() || faultIs(CopyFault::Static))
    return "ODE is not a shared library here";
  std::vector<char> bytes;
  if (faultIs(CopyFault::File) || !readFile(original.path, bytes))
    return "the file of ODE's library cannot be read";
  ElfFile elf(bytes);
  if (!elf.makeSymbolic(name)) return "ODE is part of another library";
  if (faultIs(CopyFault::Contents)) elf.spoil();
  if (faultIs(CopyFault::Load)) bytes[EI_CLASS] = ELFCLASSNONE;
  const FileDescriptor file(fileInMemory());
  if (file.number() < 0 || !writeFile(file.number(), bytes))
    return "this system has no room for files in memory";
  handle_ = dlopen(nameOf(file.number()).c_str(), RTLD_NOW | RTLD_LOCAL);
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

#else

namespace ode_parallel_sap {

LoadedLibrary libraryAt(const void*) {
  return {};
}

const char* LibraryCopy::load(const LoadedLibrary&, const char*) {
  return "copies of ODE are loaded on Linux only";
}

void* LibraryCopy::symbol(const char*) const {
  return nullptr;
}

}  // namespace ode_parallel_sap

#endif
