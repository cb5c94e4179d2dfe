// Frames recorded from the piles of examples/pile: where each body was and the bounds of its geom.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "centred_box.h"

namespace bench {

struct BodyPose {
  dReal position[3];
  dReal rotation[4];  // quaternion, ODE's order
};

// Frame by frame, the bodies in the order of the pile's world.
struct PileRecording {
  std::string scene;
  std::vector<std::vector<BodyPose>> poses;
  std::vector<Boxes> boxes;  // none in a recording of a whole run
  // Of a whole run: the step of each frame. Frames come in twos, from one step to the next.
  std::vector<std::uint32_t> steps;
};

struct BoxRecording {
  std::vector<Boxes> frames;
};

bool pileExists(const std::string& path);
// The precision of dReal must be that of the program that wrote. Throws std::runtime_error.
void writePile(const std::string& path, const PileRecording& recording);
PileRecording readPileWithPoses(const std::string& path);
std::shared_ptr<const BoxRecording> readPile(const std::string& path);

}  // namespace bench
