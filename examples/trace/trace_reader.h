// Reads the files that dParallelSAPSpaceSetTrace writes: space/trace/README.md. Knows nothing of
// ODE.
#pragma once

#include <array>
#include <cstdint>
#include <istream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "space/trace/trace_format.h"

namespace trace {

namespace format = ode_parallel_sap::trace_format;

// What is wrong with a file: where, and what.
struct BadTrace : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Pose = std::array<double, format::pose>;      // place, then the rotation's three rows
using Bounds = std::array<double, format::bounds>;  // least and greatest x, y, z

struct Body {
  std::uint32_t number, flags;  // BodyFlags
  Pose pose;
};

struct Geom {
  std::uint32_t number, parent, geom_class, flags, body;  // GeomFlags
  std::uint64_t category_bits, collide_bits;
  std::array<double, format::params> params;
  Pose pose;
  Bounds bounds;

  bool is(format::GeomFlags flag) const { return (flags & flag) != 0; }
};

// The pairs that the program's collide found.
struct PairTotals {
  std::uint64_t count = 0, sum = 0;
  bool operator==(const PairTotals& other) const {
    return count == other.count && sum == other.sum;
  }
  void add(std::uint32_t first, std::uint32_t second) {
    ++count;
    sum += format::pairSum(first, second);
  }
};

// What changed since the frame before.
struct Frame {
  std::uint64_t collide;  // of the space since the trace began, from 1 on
  std::uint32_t rules;    // Rules
  double tolerance;
  std::vector<std::uint32_t> removed;
  std::vector<Body> bodies;         // new or changed
  std::vector<Geom> geoms;          // new, or changed in more than place
  std::vector<Geom> poses;          // with number, pose and bounds only
  std::vector<Geom> bounds;         // with number and bounds only
  std::optional<PairTotals> pairs;  // where they are known
};

struct Header {
  std::uint32_t version, real_bytes, every;
  std::string configuration;  // of the program's ODE
};

class Reader {
 public:
  // All of these throw BadTrace.
  Reader(std::istream& file, const std::string& name);
  const Header& header() const { return header_; }
  // False at the end.
  bool next(Frame& frame);

 private:
  class Contents;
  // False at the end of the file.
  bool readChunk();
  void readHeader();
  Pose readPose(Contents& contents) const;
  Bounds readBounds(Contents& contents) const;
  void readFrame(Frame& frame) const;
  void readPairs(Frame& frame) const;
  [[noreturn]] void fail(const std::string& what) const;

  std::istream& file_;
  const std::string name_;
  std::uint64_t length_ = 0, at_ = 0;  // bytes of the file, and read of them
  std::string tag_;                    // of the chunk that was read last
  std::vector<unsigned char> contents_;
  bool has_chunk_ = false;  // one was read and not taken yet
  Header header_ = {};
};

}  // namespace trace
