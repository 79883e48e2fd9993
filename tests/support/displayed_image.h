#pragma once

#include "base/image.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::test {

// A linear image as a display shows it at exposure 1: 8 bits a channel, as numbers between 0 and 1.
inline Image displayed(const Image& linear) {
  const Image8 bytes = shaders::to_display(linear, 1.0f);
  Image out(bytes.width, bytes.height, 3);
  for (int y = 0; y < bytes.height; ++y)
    for (int x = 0; x < bytes.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) out.at(x, y)[c] = static_cast<float>(bytes.at(x, y)[c]) / 255.0f;
  return out;
}

}  // namespace tessera::test
