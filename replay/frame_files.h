#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <tbb/task_group.h>

#include "base/exr_file.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

// Auxiliary layers that a replay can add to its EXR files.
const std::vector<std::string>& auxiliary_layers();

// "frame_0007"
std::string frame_name(int frame);

// Those of them that only a frame with desampling has.
bool is_resolve_layer(const std::string& layer);

// Writes the images of frames, each frame while the next one is rendered: at most one is on its way.
//   frame_NNNN.exr  linear, half float; auxiliary layers as channels of their own
//   frame_NNNN.png  exposed, tone mapped, sRGB
// Each whole or not at all; of a right eye frame_NNNN.right.exr and .png.
class FrameWriter {
 public:
  struct Settings {
    std::filesystem::path folder;
    std::vector<std::string> auxiliary;
    float exposure = 1;
  };
  explicit FrameWriter(Settings settings) : settings_(std::move(settings)) {}
  ~FrameWriter();
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;

  // Takes the images. Throws WriteError where those of an earlier frame could not be written.
  void add(int frame, tilecore::FrameTargets targets, const std::string& view = "");
  // All of them are on the disk. Throws as add().
  void finish();

 private:
  void write_exr_of(const tilecore::FrameTargets& targets, const std::string& name) const;

  Settings settings_;
  tbb::task_group writing_;
};

}  // namespace tessera::replay
