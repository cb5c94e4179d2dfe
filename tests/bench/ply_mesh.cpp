#include "ply_mesh.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace bench {
namespace {

// How a number is stored.
struct Type {
  const char* names[2];
  std::size_t bytes;
  double (*read)(const char* bytes, bool big_endian);
};

template <class T>
double asDouble(const char* bytes, bool big_endian) {
  return static_cast<double>(numberAt<T>(bytes, big_endian));
}

constexpr Type types[] = {
    {{"char", "int8"}, 1, asDouble<std::int8_t>},
    {{"uchar", "uint8"}, 1, asDouble<std::uint8_t>},
    {{"short", "int16"}, 2, asDouble<std::int16_t>},
    {{"ushort", "uint16"}, 2, asDouble<std::uint16_t>},
    {{"int", "int32"}, 4, asDouble<std::int32_t>},
    {{"uint", "uint32"}, 4, asDouble<std::uint32_t>},
    {{"float", "float32"}, 4, asDouble<float>},
    {{"double", "float64"}, 8, asDouble<double>},
};

const Type* typeNamed(const std::string& name) {
  for (const Type& type : types)
    if (name == type.names[0] || name == type.names[1]) return &type;
  throw std::runtime_error("no type " + name);
}

// What the header says.
struct Layout {
  bool big_endian = false;
  std::size_t vertices = 0, faces = 0;
  std::size_t vertex_bytes = 0, at[3] = {};
  const Type* coordinates[3] = {};
  const Type *list_length = nullptr, *list_number = nullptr;
};

class HeaderReader {
 public:
  // Reads up to the line after which the data begin.
  Layout read(std::istream& file) {
    std::string line;
    if (!std::getline(file, line) || line.compare(0, 3, "ply")) throw std::runtime_error("no PLY");
    while (std::getline(file, line)) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line == "end_header") return layout_;
      std::istringstream words(line);
      take(words);
    }
    throw std::runtime_error("no end of the header");
  }

 private:
  void take(std::istringstream& words) {
    std::string word;
    words >> word;
    if (word == "format") {
      words >> word;
      if (word == "ascii") throw std::runtime_error("not binary");
      layout_.big_endian = word == "binary_big_endian";
    } else if (word == "element") {
      std::size_t count = 0;
      words >> element_ >> count;
      if (element_ == "vertex") layout_.vertices = count;
      if (element_ == "face") layout_.faces = count;
    } else if (word == "property") {
      takeProperty(words);
    }
  }

  void takeProperty(std::istringstream& words) {
    std::string type, name;
    words >> type;
    if (element_ == "face") {
      std::string length, number;
      words >> length >> number;
      if (type != "list" || layout_.list_length) throw std::runtime_error("faces with more");
      layout_.list_length = typeNamed(length);
      layout_.list_number = typeNamed(number);
    } else if (element_ == "vertex") {
      words >> name;
      const Type* const of = typeNamed(type);
      for (int axis = 0; axis < 3; ++axis)
        if (name == std::string(1, "xyz"[axis])) {
          layout_.coordinates[axis] = of;
          layout_.at[axis] = layout_.vertex_bytes;
        }
      layout_.vertex_bytes += of->bytes;
    }
  }

  Layout layout_;
  std::string element_;
};

class DataReader {
 public:
  DataReader(const Layout& layout, const std::string& bytes) : layout_(layout), bytes_(bytes) {}

  PlyMesh read() {
    PlyMesh mesh;
    for (std::size_t i = 0; i < layout_.vertices; ++i) {
      const char* const vertex = take(layout_.vertex_bytes);
      mesh.vertices.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!layout_.coordinates[axis]) throw std::runtime_error("vertices without coordinates");
        mesh.vertices.back()[axis] =
            layout_.coordinates[axis]->read(vertex + layout_.at[axis], layout_.big_endian);
      }
    }
    for (std::size_t i = 0; i < layout_.faces; ++i) mesh.faces.push_back(nextFace());
    return mesh;
  }

 private:
  std::array<std::uint32_t, 3> nextFace() {
    if (!layout_.list_length) throw std::runtime_error("faces without vertices");
    if (nextNumber(*layout_.list_length) != 3) throw std::runtime_error("not triangles");
    std::array<std::uint32_t, 3> face;
    for (std::uint32_t& vertex : face) {
      const double number = nextNumber(*layout_.list_number);
      if (!(number >= 0 && number < static_cast<double>(layout_.vertices)))
        throw std::runtime_error("a face of no vertex");
      vertex = static_cast<std::uint32_t>(number);
    }
    return face;
  }
  double nextNumber(const Type& type) { return type.read(take(type.bytes), layout_.big_endian); }
  const char* take(std::size_t bytes) {
    if (bytes_.size() - at_ < bytes) throw std::runtime_error("ends too early");
    at_ += bytes;
    return bytes_.data() + at_ - bytes;
  }

  const Layout& layout_;
  const std::string& bytes_;
  std::size_t at_ = 0;
};

}  // namespace

std::string readWhole(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

PlyMesh readPly(const std::string& path) try {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot be read");
  const Layout layout = HeaderReader().read(file);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return DataReader(layout, bytes).read();
} catch (const std::runtime_error& error) {
  throw std::runtime_error(path + ": " + error.what());
}

}  // namespace bench
