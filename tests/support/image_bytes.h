#pragma once

#include <string>

#include "tilecore/frame_targets.h"

namespace tessera::test {

// All channels of an image as bytes: two images are the same bit by bit where these are equal.
inline std::string image_bytes(const tilecore::FrameTargets& t) {
  std::string bytes;
  const auto add = [&](const auto& values) {
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
  };
  add(t.color.values);
  add(t.depth.values);
  add(t.patch.values);
  add(t.normal.values);
  return bytes;
}

}  // namespace tessera::test
