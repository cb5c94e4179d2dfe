#include "trace_reader.h"

#include <cstring>

namespace trace {

namespace {

std::uint64_t wordAt(const unsigned char* bytes, std::size_t count = 8) {
  std::uint64_t word = 0;
  for (std::size_t i = count; i-- > 0;) word = word << 8 | bytes[i];
  return word;
}

}  // namespace

// Takes one thing after the other out of a chunk.
class Reader::Contents {
 public:
  explicit Contents(const Reader& reader) : reader_(reader) {}

  std::uint32_t take32() { return static_cast<std::uint32_t>(take(4)); }
  std::uint64_t take64() { return take(8); }
  double takeDouble() {
    const std::uint64_t bits = take(8);
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  template <std::size_t count>
  void takeReals(std::array<double, count>& reals) {
    for (double& real : reals) real = reader_.header_.real_bytes == 8 ? takeDouble() : takeSingle();
  }
  std::string takeText() {
    const std::size_t length = take32();
    if (length > left()) reader_.fail("a text is longer than what it is in");
    const auto* const begin = reinterpret_cast<const char*>(reader_.contents_.data() + at_);
    at_ += length;
    return std::string(begin, length);
  }
  // Whether so many things of that size can be there at all.
  void expect(std::uint64_t count, std::size_t bytes) const {
    if (count > left() / bytes) reader_.fail("it names more than it holds");
  }
  std::size_t left() const { return reader_.contents_.size() - at_; }

 private:
  double takeSingle() {
    const std::uint32_t bits = take32();
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return static_cast<double>(value);
  }
  std::uint64_t take(std::size_t bytes) {
    if (bytes > left()) reader_.fail("it is too short for what it should hold");
    const std::uint64_t word = wordAt(reader_.contents_.data() + at_, bytes);
    at_ += bytes;
    return word;
  }

  const Reader& reader_;
  std::size_t at_ = 0;
};

Reader::Reader(std::istream& file, const std::string& name) : file_(file), name_(name) {
  if (!file_) fail("it cannot be read");
  file_.seekg(0, std::ios::end);
  const std::streamoff length = file_.tellg();
  if (length < 0) fail("it cannot be read");
  length_ = static_cast<std::uint64_t>(length);
  file_.seekg(0);
  char magic[format::tag_bytes] = {};
  file_.read(magic, sizeof magic);
  if (!file_ || std::memcmp(magic, format::magic, sizeof magic) != 0) fail("it is no trace");
  at_ = sizeof magic;
  if (!readChunk() || tag_ != format::header_tag) fail("it has no header");
  readHeader();
}

bool Reader::readChunk() {
  if (at_ == length_) return false;
  unsigned char head[format::chunk_head_bytes];
  if (length_ - at_ < sizeof head) fail("it ends within a chunk");
  file_.read(reinterpret_cast<char*>(head), sizeof head);
  const std::uint64_t size = wordAt(head + 8);
  if (!file_ || size > length_ - at_ - sizeof head) fail("it ends within a chunk");
  if (size % 8 != 0) fail("a chunk's length is no multiple of eight");
  contents_.resize(size);
  file_.read(reinterpret_cast<char*>(contents_.data()), static_cast<std::streamsize>(size));
  if (!file_) fail("it ends within a chunk");
  std::uint64_t checksum = format::checksum_begin;
  checksum = format::addToChecksum(checksum, wordAt(head));
  checksum = format::addToChecksum(checksum, size);
  for (std::size_t i = 0; i < size; i += 8)
    checksum = format::addToChecksum(checksum, wordAt(contents_.data() + i));
  if (checksum != wordAt(head + 16)) fail("a chunk's checksum is wrong: the file was changed");
  tag_.assign(reinterpret_cast<const char*>(head), format::tag_bytes);
  at_ += sizeof head + size;
  return true;
}

void Reader::readHeader() {
  Contents contents(*this);
  header_.version = contents.take32();
  const std::uint32_t order = contents.take32();
  if (header_.version != format::version)
    fail("it is of version " + std::to_string(header_.version) + ", this reads version " +
         std::to_string(format::version));
  if (order != format::byte_order) fail("its byte order is not known");
  header_.real_bytes = contents.take32();
  if (header_.real_bytes != 4 && header_.real_bytes != 8) fail("its precision is not known");
  header_.every = contents.take32();
  header_.configuration = contents.takeText();
}

bool Reader::next(Frame& frame) {
  if (!has_chunk_ && !readChunk()) return false;
  has_chunk_ = false;
  if (tag_ != format::frame_tag) fail("a chunk is of no kind that is known there");
  frame = Frame();
  readFrame(frame);
  has_chunk_ = readChunk();
  if (has_chunk_ && tag_ == format::pairs_tag) {
    readPairs(frame);
    has_chunk_ = false;
  }
  return true;
}

Pose Reader::readPose(Contents& contents) const {
  Pose pose;
  contents.takeReals(pose);
  return pose;
}

Bounds Reader::readBounds(Contents& contents) const {
  Bounds bounds;
  contents.takeReals(bounds);
  return bounds;
}

void Reader::readFrame(Frame& frame) const {
  Contents contents(*this);
  frame.collide = contents.take64();
  frame.rules = contents.take32();
  contents.take32();
  frame.tolerance = contents.takeDouble();
  std::uint32_t counts[6];
  for (std::uint32_t& count : counts) count = contents.take32();
  for (const std::uint32_t count : counts) contents.expect(count, sizeof(std::uint32_t));
  for (std::uint32_t i = 0; i < counts[0]; ++i) frame.removed.push_back(contents.take32());
  if (counts[0] % 2) contents.take32();
  for (std::uint32_t i = 0; i < counts[1]; ++i) {
    const std::uint32_t number = contents.take32(), flags = contents.take32();
    frame.bodies.push_back({number, flags, readPose(contents)});
  }
  for (std::uint32_t i = 0; i < counts[2]; ++i) {
    Geom geom = {};
    for (std::uint32_t* field :
         {&geom.number, &geom.parent, &geom.geom_class, &geom.flags, &geom.body})
      *field = contents.take32();
    contents.take32();
    geom.category_bits = contents.take64();
    geom.collide_bits = contents.take64();
    contents.takeReals(geom.params);
    geom.pose = readPose(contents);
    geom.bounds = readBounds(contents);
    frame.geoms.push_back(geom);
  }
  for (std::uint32_t i = 0; i < counts[3] + std::uint64_t(counts[4]); ++i) {
    Geom geom = {};
    geom.number = contents.take32();
    contents.take32();
    if (i < counts[3]) geom.pose = readPose(contents);
    geom.bounds = readBounds(contents);
    (i < counts[3] ? frame.poses : frame.bounds).push_back(geom);
  }
  if (contents.left() != 0) fail("a frame holds more than it names");
}

void Reader::readPairs(Frame& frame) const {
  Contents contents(*this);
  if (contents.take64() != frame.collide) fail("pairs are of another frame");
  frame.pairs = PairTotals{contents.take64(), 0};
  frame.pairs->sum = contents.take64();
}

void Reader::fail(const std::string& what) const {
  throw BadTrace(name_ + ": " + what + " (at byte " + std::to_string(at_) + ")");
}

}  // namespace trace
