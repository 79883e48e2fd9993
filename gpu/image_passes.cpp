#include "gpu/image_passes.h"

#include "base/parallel.h"
#include "base/round_up.h"

namespace tessera::gpu {

using tilecore::TileCore;

void move_scene_color(WorkRecorder::Round& round, const OrderedTiles& tiles, const tilecore::TileJob& job, int level,
                      bool write) {
  const shaders::RadianceImage& image = *job.scene_color;
  constexpr auto kTexelBytes = static_cast<std::uint64_t>(shaders::RadianceImage::kBlocks.bytes);
  TileArray texels{memory::Unit::kResolve, memory::Purpose::kSceneColor, write};
  for (int above = 0; above < level; ++above)
    texels.base += round_up(
        kTexelBytes * static_cast<std::uint64_t>(image.width(above)) * static_cast<std::uint64_t>(image.height(above)),
        job.burst_bytes());
  const auto bytes = [&](IntRect pixels) {
    const IntRect part = tilecore::reduced_by(image, level, pixels);
    return kTexelBytes * static_cast<std::uint64_t>(part.width()) * static_cast<std::uint64_t>(part.height());
  };
  tiles.move(round, texels, bytes, [](binner::TileIndex) { return true; });
}

ImagePass reduce_pass(const ViewRun& run, const OrderedTiles& tiles) {
  ImagePass pass{.name = "reduce", .stage = "reduce", .waits = false};
  const tilecore::TileJob& job = run.job;
  pass.begin = [&job] {
    shaders::RadianceImage& image = *job.scene_color;
    for (int level = 1; level < image.level_count(); ++level)
      parallel_for(static_cast<std::size_t>(image.height(level)), [&](std::size_t row) {
        const int y = static_cast<int>(row);
        image.reduce(level, {0, y, image.width(level), y + 1});
      });
  };
  pass.work = [&job](TileCore& core, binner::TileIndex tile) { core.count_reduced(job, tile); };
  // A level lies behind the one above; each is read once, when the next one is made.
  pass.share = [&job, tiles](WorkRecorder::Round& round) {
    const int levels = job.scene_color->level_count();
    for (int level = 0; level < levels; ++level) {
      if (level > 0) move_scene_color(round, tiles, job, level, true);
      if (level + 1 < levels) move_scene_color(round, tiles, job, level, false);
    }
  };
  return pass;
}

ImagePass stencil_pass(const ViewRun& run) {
  ImagePass pass{.name = "stencils", .stage = "resolve_neighbours"};
  pass.work = [&run](TileCore& core, binner::TileIndex tile) {
    core.finish_deferred(run.job, tile, run.result.targets);
  };
  return pass;
}

ImagePass copy_pass(const ViewRun& run, const CopyPass& copy) {
  ImagePass pass{.name = copy.name, .stage = "copy", .copy = &copy};
  pass.work = [&run, &copy](TileCore& core, binner::TileIndex tile) {
    core.copy(run.job, tile, copy.actions, run.result.targets);
  };
  return pass;
}

}  // namespace tessera::gpu
