#include "pile_recording.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace bench {
namespace {

struct Header {
  char magic[8];
  char scene[16];
  std::uint32_t real_bytes, whole_run;
  std::uint64_t frames, bodies;
};
constexpr char magic[8] = {'p', 'i', 'l', 'e', ' ', 'v', '1', '\n'};

template <class T>
void writeAll(std::ofstream& file, const std::vector<T>& items) {
  file.write(reinterpret_cast<const char*>(items.data()),
             static_cast<std::streamsize>(items.size() * sizeof(T)));
}

template <class T>
void readAll(std::ifstream& file, std::vector<T>& items) {
  file.read(reinterpret_cast<char*>(items.data()),
            static_cast<std::streamsize>(items.size() * sizeof(T)));
}

}  // namespace

bool pileExists(const std::string& path) {
  return std::ifstream(path).good();
}

void writePile(const std::string& path, const PileRecording& recording) {
  std::ofstream file(path, std::ios::binary);
  Header header = {};
  std::memcpy(header.magic, magic, sizeof magic);
  std::strncpy(header.scene, recording.scene.c_str(), sizeof header.scene - 1);
  header.real_bytes = sizeof(dReal);
  header.whole_run = !recording.steps.empty();
  header.frames = recording.poses.size();
  header.bodies = recording.poses.front().size();
  file.write(reinterpret_cast<const char*>(&header), sizeof header);
  writeAll(file, recording.steps);
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    writeAll(file, recording.poses[i]);
    if (!header.whole_run) writeAll(file, recording.boxes[i]);
  }
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

PileRecording readPileWithPoses(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Header header = {};
  file.read(reinterpret_cast<char*>(&header), sizeof header);
  if (!file || std::memcmp(header.magic, magic, sizeof magic) != 0)
    throw std::runtime_error(path + " is no recorded pile");
  if (header.real_bytes != sizeof(dReal))
    throw std::runtime_error(path + " was recorded in another precision");
  PileRecording recording;
  recording.scene = header.scene;
  if (header.whole_run) {
    recording.steps.resize(header.frames);
    readAll(file, recording.steps);
  }
  for (std::uint64_t i = 0; i < header.frames; ++i) {
    readAll(file, recording.poses.emplace_back(header.bodies));
    if (!header.whole_run) readAll(file, recording.boxes.emplace_back(header.bodies));
  }
  if (!file || recording.poses.size() < 2 || header.bodies == 0)
    throw std::runtime_error(path + " ends too early");
  return recording;
}

std::shared_ptr<const BoxRecording> readPile(const std::string& path) {
  auto boxes = std::make_shared<BoxRecording>();
  boxes->frames = readPileWithPoses(path).boxes;
  return boxes;
}

}  // namespace bench
