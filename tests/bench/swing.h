// How boxes of the benchmarks move from frame to frame.
#pragma once

namespace bench {

// How far there and back: 0, 1, ... 8, 7, ... -8, -7, ... 0, 1, ...
inline int swing(int frame) {
  const int phase = (frame + 8) % 32;
  return phase <= 16 ? phase - 8 : 24 - phase;
}

}  // namespace bench
