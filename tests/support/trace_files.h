// Folders for files of traces, and what they have in them.
#pragma once

#include <ode_parallel_sap/parallel_sap_space.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "trace_reader.h"

namespace sap_test {

// A folder of the test's own, gone with it.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "trace-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_))
      names.push_back(entry.path().string());
    return names;
  }

 private:
  std::filesystem::path path_;
};

inline std::size_t framesIn(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  trace::Reader reader(file, path);
  std::size_t frames = 0;
  for (trace::Frame frame; reader.next(frame);) ++frames;
  return frames;
}

inline dSpaceID boxes(int count) {
  const dSpaceID space = dParallelSAPSpaceCreate(nullptr);
  for (int i = 0; i < count; ++i)
    dGeomSetPosition(dCreateBox(space, 1, 1, 1), static_cast<dReal>(0.75 * i), 0, 0);
  return space;
}

}  // namespace sap_test
