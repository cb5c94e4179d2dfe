// Triangle meshes of binary PLY files.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace bench {

struct PlyMesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
};

// Binary, of either byte order; the properties of a vertex other than x, y and z are left out, and
// so are elements but vertices and faces, which come first. Throws std::runtime_error where the
// file is not such a mesh.
PlyMesh readPly(const std::string& path);

// The bytes of a file. Throws std::runtime_error where it cannot be read.
std::string readWhole(const std::string& path);

template <class T>
T numberAt(const char* bytes, bool big_endian) {
  char own[sizeof(T)];
  for (std::size_t i = 0; i < sizeof(T); ++i)
    own[i] = bytes[big_endian == (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) ? i : sizeof(T) - 1 - i];
  T number;
  std::memcpy(&number, own, sizeof number);
  return number;
}

}  // namespace bench
