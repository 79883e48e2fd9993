#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <tbb/task_group.h>

#include "base/exr_file.h"
#include "gpu/frame_timeline.h"
#include "gpu/tile_maps.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

// Auxiliary layers that a replay can add to its EXR files.
const std::vector<std::string>& auxiliary_layers();

// "frame_0007"
std::string frame_name(int frame);

// Whether only frames with desampling have this layer.
bool is_resolve_layer(const std::string& layer);

// Writes the images of frames, each frame while the next one is rendered: at most one frame is being written.
//   frame_NNNN.exr  linear, half float; auxiliary layers as channels of their own
//   frame_NNNN.png  exposed, tone mapped, sRGB
// A right eye has frame_NNNN.right.exr and .png. Each file is written whole or not at all.
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

  // Takes the images. Throws WriteError if an earlier frame's images could not be written.
  void add(int frame, tilecore::FrameTargets targets, const std::string& view = "");
  // Waits until all images are on the disk. Throws as add().
  void finish();

 private:
  void write_exr_of(const tilecore::FrameTargets& targets, const std::string& name) const;

  Settings settings_;
  tbb::task_group writing_;
};

// {"schema": "tessera.tiles/1", "frame", "origin": [x, y], "tile": [w, h], "grid": [columns, rows],
//  "maps": {NAME: {"unit", "meaning", "values": [...]}}}; one line per map. `members`: more of them, in front of the maps,
// each with a comma behind it.
std::string tile_maps_json(int frame, const gpu::TileMaps& maps, const std::string& members = "");

// "tiles_0007.json"
std::string tile_maps_name(int frame);

// A member of tiles_NNNN.json, with a comma behind it: the frame in time, in whole cycles (of a stereo pair, the left
// eye).
//   "timeline": {"cycles", "slots", "windows", "geometry": [[bound begin, end, bin begin, end], ... by round],
//                "tile", "pass", "core", "slot", "begin": [one of each tile in the scheduler's order],
//                "spans": [eight durations of each tile: waits for data, visibility, waits for a unit, for data, shading,
//                waits for a unit, for data, store],
//                "bytes": {source: [by window]}, "busy": {unit: [percent, by window]}, "list_bytes": [most, by window]}
// Sources, units and windows without values are left out.
std::string timeline_member(const gpu::FrameTimeline& timeline);

}  // namespace tessera::replay
