// What a trace file is made of, for those who write and who read it: README.md of this room.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ode_parallel_sap::trace_format {

// fixed: all of these are the format
constexpr char magic[9] = "ODEtrace";
constexpr char header_tag[9] = "header  ";
constexpr char frame_tag[9] = "frame   ";
constexpr char pairs_tag[9] = "pairs   ";
constexpr std::size_t tag_bytes = 8;              // fixed: the format; of the magic, too
constexpr std::size_t chunk_head_bytes = 24;      // fixed: the format; tag, length, checksum
constexpr std::uint32_t version = 1;              // fixed: the format
constexpr std::uint32_t byte_order = 0x01020304;  // fixed: the format

// The reals of a geom.
constexpr int params = 4;  // fixed: the most numbers that a shape has
constexpr int pose = 12;   // fixed: place, then the rotation's three rows
constexpr int bounds = 6;  // fixed: as in dGeomGetAABB

enum GeomFlags : std::uint32_t {
  enabled = 1,
  zero_sized = 2,
  offset = 4,  // the pose is that on the body
  space = 8,
  placeable = 16
};
enum BodyFlags : std::uint32_t { awake = 1, kinematic = 2 };
enum Rules : std::uint32_t { skip_static = 1, skip_asleep = 2, cull_planes = 4 };

// One step of a chunk's checksum, over tag, length and contents, eight bytes at a time.
constexpr std::uint64_t checksum_begin = 14695981039346656037ull;  // fixed: FNV-1a's
constexpr std::uint64_t checksum_factor = 1099511628211ull;        // fixed: likewise
constexpr std::uint64_t addToChecksum(std::uint64_t checksum, std::uint64_t word) {
  return (checksum ^ word) * checksum_factor;
}

// What a pair adds to the sum of a frame's pairs, by the numbers of its geoms (splitmix64).
constexpr std::uint64_t pairSum(std::uint32_t first, std::uint32_t second) {
  std::uint64_t z = (std::uint64_t(first) << 32 | second) + 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

}  // namespace ode_parallel_sap::trace_format
