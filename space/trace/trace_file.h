// The file of a trace: chunks, each written whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace ode_parallel_sap {

// The contents of a chunk, little-endian whatever the machine is.
class TraceBytes {
 public:
  void clear() { bytes_.clear(); }
  void put32(std::uint32_t value) { put(value, sizeof value); }
  void put64(std::uint64_t value) { put(value, sizeof value); }
  template <class Real>
  void putReals(const Real* reals, std::size_t count) {
    using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
    static_assert(sizeof(Real) == sizeof(Bits), "IEEE single or double");
    for (std::size_t i = 0; i < count; ++i) {
      Bits bits;
      std::memcpy(&bits, reals + i, sizeof bits);
      put(bits, sizeof bits);
    }
  }
  void append(const TraceBytes& other) {
    bytes_.insert(bytes_.end(), other.bytes_.begin(), other.bytes_.end());
  }
  void putText(const char* text) {
    const std::size_t length = std::strlen(text);
    put32(static_cast<std::uint32_t>(length));
    bytes_.insert(bytes_.end(), text, text + length);
  }
  // Zeros up to a multiple of eight bytes.
  void pad() { bytes_.resize((bytes_.size() + 7) / 8 * 8); }
  const unsigned char* data() const { return bytes_.data(); }
  std::size_t size() const { return bytes_.size(); }

 private:
  void put(std::uint64_t value, std::size_t bytes) {
    const std::size_t end = bytes_.size();
    bytes_.resize(end + bytes);
    unsigned char* const to = bytes_.data() + end;
    for (std::size_t i = 0; i < bytes; ++i) to[i] = static_cast<unsigned char>(value >> (8 * i));
  }
  std::vector<unsigned char> bytes_;
};

class TraceFile {
 public:
  // Makes the file, over one that is there. False with a message where that cannot be.
  bool open(const std::string& path);
  bool isOpen() const { return file_ != nullptr; }
  // A chunk. Where it cannot be written, dMessage says so, and the file ends before it and is
  // closed.
  void write(const char (&tag)[9], TraceBytes& contents);
  // Ends the trace, with this reason.
  void giveUp(const char* why);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  bool put(const TraceBytes& bytes);

  std::unique_ptr<std::FILE, Close> file_;
  std::string path_;
  std::uintmax_t whole_ = 0;  // bytes, of chunks that were written
  TraceBytes head_;
};

}  // namespace ode_parallel_sap
