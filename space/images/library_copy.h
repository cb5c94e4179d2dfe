// A second copy of a shared library of this process, with variables of its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ode_parallel_sap {

// A part of a loaded library, in memory.
struct Segment {
  std::uintptr_t begin, end;
  bool writable;

  bool holds(std::uintptr_t address) const { return address >= begin && address < end; }
};

struct LoadedLibrary {
  std::uintptr_t base = 0;
  std::string path;  // of the file it was loaded from; empty for the program itself
  std::vector<Segment> segments;
};

// The library that an address of this process lies in; without segments if none.
LoadedLibrary libraryAt(const void* address);

// The copy shares nothing with the original but the libraries that both need: it is loaded from a
// file in memory, in which DT_SYMBOLIC has taken the place of the library's DT_SONAME, so that it
// finds its own functions and variables first and that nobody who asks for the library by name
// gets the copy. (RTLD_DEEPBIND would do that, too, but bind malloc past what a program preloads.)
// It stays for the life of the process.
class LibraryCopy {
 public:
  // Loads a copy of a library whose DT_SONAME begins with `name`. Null, or why it could not.
  const char* load(const LoadedLibrary& original, const char* name);

  const LoadedLibrary& library() const { return library_; }
  // Null if there is none.
  void* symbol(const char* name) const;

 private:
  void* handle_ = nullptr;
  LoadedLibrary library_;
};

// Whether a test has this part of loading a copy fail: "static", "file", "memory", "load",
// "contents" or "table" in ODE_PARALLEL_SAP_TEST_IMAGE_FAULT.
bool copyFails(const char* part);

}  // namespace ode_parallel_sap
