#include "machine.h"

#include <sched.h>

#include <cctype>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "commit.h"

namespace bench {
namespace {

// What follows the colon of the first line that begins with `key`.
std::string valueIn(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t at = line.find_first_not_of(" \t", line.find(':') + 1);
    return at == std::string::npos ? "" : line.substr(at);
  }
  return "";
}

// All GPUs of one model: "2 x NVIDIA H200".
std::string gpus() {
  std::error_code without;
  int count = 0;
  std::string model;
  for (const auto& gpu : std::filesystem::directory_iterator("/proc/driver/nvidia/gpus", without)) {
    ++count;
    model = valueIn(gpu.path() / "information", "Model");
  }
  return count > 0 ? std::to_string(count) + " x " + model : "";
}

// The first word of digits and dots: 580.159.03.
std::string driver() {
  std::ifstream file("/proc/driver/nvidia/version");
  for (std::string word; file >> word;)
    if (std::isdigit(static_cast<unsigned char>(word[0])) && word.find('.') != std::string::npos)
      return word;
  return "";
}

int usableCores() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d", std::gmtime(&now));
  return text;
}

}  // namespace

const Machine& machine() {
  static const Machine machine = {valueIn("/proc/cpuinfo", "model name"),
                                  usableCores(),
                                  gpus(),
                                  driver(),
                                  BENCH_COMPILER,
                                  BENCH_FLAGS,
                                  BENCH_COMMIT,
                                  today()};
  return machine;
}

}  // namespace bench
