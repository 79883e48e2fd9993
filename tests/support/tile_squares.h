#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/support/pass_graphs.h"
#include "tests/support/tests.h"

// A scene of squares, one in each tile of 16x16 pixels, for tests of what tiles store, and frames of it.
namespace tessera::test::tiled {

constexpr int kWidth = 96, kHeight = 64, kTile = 16;
constexpr std::uint64_t kPixels = kWidth * kHeight, kTilePixels = kTile * kTile, kTiles = kPixels / kTilePixels;
inline const std::string kRaw = "frame_buffer.compression=none", kCompressed = "frame_buffer.compression=lossless",
                         kTransactions = "frame_buffer.transaction_elimination=true",
                         kRendering = "tile.rendering_elimination=true";
inline const std::array<scene::AttachmentFormat, 3> kColorFormats = {
    scene::AttachmentFormat::kRgba8, scene::AttachmentFormat::kRgb10A2, scene::AttachmentFormat::kRgba16F};

// A plain background, 16 pixels a unit, and a patch beside the image.
inline scene::Capture nothing() {
  scene::Capture capture;
  const int plain = add_material(capture, {});
  add_node(capture, patches(flat_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), plain), DVec3(100, 0, 0));
  capture.settings.background = Vec3(0.1f, 0.4f, 0.9f);
  capture.settings.frame_rate = 16;
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 3, camera.y_mag = 2;
  add_camera(capture, {0, 0, 7}, camera);
  return capture;
}

// A square of about half a unit inside of a tile of 16x16 pixels; squares of tile 9 or, with `all`, of all tiles are red at
// first and change to green, if they change.
inline scene::Capture squares(bool all, bool change) {
  scene::Capture capture = nothing();
  scene::Material red;
  red.base_color = {1, 0, 0, 1};
  const int still = add_material(capture, red), changing = add_material(capture, red);
  for (int tile = 0; tile < static_cast<int>(kTiles); ++tile) {
    const double size = 0.4 + 0.01 * tile, x = tile % 6 - 2.5, y = 1.5 - tile / 6;
    add_node(capture,
             patches(flat_patch({-size / 2, -size / 2, 0}, {size, 0, 0.1}, {0, size, 0.2}),
                     all || tile == 9 ? changing : still),
             DVec3(x, y, 0));
  }
  if (change)
    play(capture, {.object = changing,
                   .part = material_number("/pbrMetallicRoughness/baseColorFactor"),
                   .path = scene::AnimatedPath::kMaterialNumber,
                   .components = 4,
                   .times = {0, 1},
                   .values = {1, 0, 0, 1, 0, 1, 0, 1}});
  return capture;
}

struct Asked {
  std::vector<int> frames{0};
  int width = kWidth, height = kHeight;
  bool record_accesses = false;
  IntRect region{};  // empty: the whole frame
};
inline std::vector<gpu::FrameResult> frames_of(scene::Capture capture, const scene::PassGraph& graph,
                                               const std::vector<std::string>& keys, const Asked& run = {}) {
  gpu::RunSettings settings;
  gpu::GpuConfiguration machine;
  for (const char* key : {"tile.width=16", "tile.height=16", "frame_buffer.compression=none"})
    gpu::apply_setting(key, settings, machine);
  for (const std::string& key : keys) gpu::apply_setting(key, settings, machine);
  capture = with_graph(std::move(capture), graph);
  const IntRect whole{0, 0, run.width, run.height};
  gpu::RenderRequest request{run.width, run.height, run.region.empty() ? whole : run.region};
  request.record_accesses = run.record_accesses;
  gpu::Device device(capture, machine, settings, request);
  std::vector<gpu::FrameResult> all;
  for (const int frame : run.frames) all.push_back(device.render(frame));
  return all;
}

// Bytes of attachments that a frame or a pass stores, and loads.
inline std::uint64_t stored(const gpu::FrameCounters& counters) {
  return counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kAttachment).written_bytes;
}
inline std::uint64_t loaded(const gpu::FrameCounters& counters) {
  return counters.ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kAttachment).read_bytes;
}
inline bool same_image(const gpu::FrameResult& a, const gpu::FrameResult& b) {
  return a.targets.color.values == b.targets.color.values;
}

// Bursts of attachments that a frame writes, and that it reads, with the number of times.
inline std::array<std::map<std::uint64_t, int>, 2> bursts_moved(const gpu::FrameResult& frame) {
  std::array<std::map<std::uint64_t, int>, 2> moved;
  for (const gpu::FrameRecord::RoundAccesses& round : frame.model->record.accesses)
    for (const std::vector<memory::Access>& tile : round.tiles)
      for (const memory::Access& access : tile)
        for (std::uint64_t at = 0; access.purpose == memory::Purpose::kAttachment && at < access.bytes; at += 64)
          ++moved[access.write ? 0 : 1][access.offset + at];
  return moved;
}

}  // namespace tessera::test::tiled
