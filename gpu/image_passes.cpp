#include "gpu/image_passes.h"

#include <algorithm>
#include <memory>

#include "base/parallel.h"
#include "base/round_up.h"
#include "shaders_cpp/bloom.h"
#include "shaders_cpp/taa.h"
#include "tilecore/resolve/block_codes.h"

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
  // A level lies behind the one above; each is read once, to make the next one.
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

namespace {

// [assumed] Clocks of a lane: places of lookups and their weighted sum, on the way up the mean with its own level; the
// bloom mixed into a pixel. Packing the result takes 4.
constexpr tilecore::ImageShader kDown{.lookups = shaders::kBloomDownLookups, .clocks = 2 + 8 + 15 + 4, .registers = 16},
    kUp{.lookups = shaders::kBloomUpLookups, .clocks = 2 + 16 + 24 + 6 + 4, .registers = 16},
    kMix{.lookups = 1, .clocks = 2 + 6 + 4, .registers = 8};

// [assumed] Clocks of a lane for a pixel of temporal antialiasing: eight comparisons of neighbours with a selection each; its
// place in the previous frame; weights and places of the lookup, and the weighted sum of five taps; ten colours to YCoCg,
// minima and maxima of four channels over nine; clipping; the way back; luma weights; the mix. Packing takes 4. Without a
// previous frame it copies.
constexpr int kTaaNeighbourLookups = 2 * shaders::kTaaNeighbours;  // colours, and depths or velocities
constexpr tilecore::ImageShader kMixHistory{.lookups = kTaaNeighbourLookups + shaders::kTaaHistoryLookups,
                                            .clocks = 8 * 2 + 4 + (30 + 25) + (10 * 6 + 2 * 4 * 8) + 18 + 4 + 6 + 9 + 4,
                                            .registers = 32},
    kBeginHistory{.lookups = 1, .clocks = 4, .registers = 8};
// With depths the velocity of the nearest one is a lookup more.
constexpr tilecore::ImageShader with_depths(tilecore::ImageShader shader) {
  ++shader.lookups;
  return shader;
}

// All tiles load or store their pieces of an array.
void move_all(WorkRecorder::Round& round, const OrderedTiles& tiles, const StoredArray& array, bool write) {
  array.move(round, tiles.order, write, [](binner::TileIndex) { return true; });
}

// Codes a tile's piece of an image.
template <class Code>
void store_image(TileCore& core, binner::TileIndex tile, StoredArray& array, const Image& image, const Code& code) {
  const IntRect piece = array.piece(tile);
  const auto columns = static_cast<std::size_t>(std::max(piece.width(), 1));
  core.count(array.store(tile, [&](tilecore::TexelEncoder& encoder) {
    encoder.add_plane([&](int, std::size_t texel) {
      return code(image.at(piece.x0 + static_cast<int>(texel % columns), piece.y0 + static_cast<int>(texel / columns)));
    });
  }));
}

// Adds the bloom to the pixels of a tile.
void add_bloom(const ViewRun& run, IntRect pixels, const Image& bloom) {
  tilecore::FrameTargets& targets = run.result.targets;
  const IntRect all = targets.region;
  for (int y = pixels.y0; y < pixels.y1; ++y)
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const auto pixel = targets.color.at(x - all.x0, y - all.y0);
      const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(all.width()),
                  v = (static_cast<float>(y) + 0.5f) / static_cast<float>(all.height());
      const Vec3 mixed =
          with_bloom({pixel[0], pixel[1], pixel[2]}, shaders::bloom_lookup(bloom, u, v), run.bloom_strength);
      for (std::size_t c = 0; c < 3; ++c) pixel[c] = mixed[static_cast<int>(c)];
    }
}

}  // namespace

ImagePass taa_pass(const ViewRun& run, const OrderedTiles& tiles) {
  const Taa& taa = *run.taa;
  ImagePass pass{.name = taa.name, .stage = "taa"};
  pass.begin = [&run, &taa] { run.taa_history->resolve(taa, run.result.targets.color); };
  StoredArrays& arrays = *run.arrays;
  // The images that it reads besides the colours.
  const auto for_each_read = [&run, &taa, &arrays](const auto& visit) {
    if (!run.taa_history->follows()) return;
    visit(arrays.velocities);
    if (taa.depth_bytes > 0) visit(arrays.depths);
    visit(arrays.history_before);
  };
  pass.work = [&run, &taa, &arrays, tiles, for_each_read](TileCore& core, binner::TileIndex tile) {
    core.run_image_shader(run.job, tilecore::pixel_count(tiles.grid.pixels(tile)),
                          !run.taa_history->follows() ? kBeginHistory
                          : taa.depth_bytes > 0       ? with_depths(kMixHistory)
                                                      : kMixHistory);
    for_each_read([&](const StoredArray& array) { core.count(array.load(tile)); });
    store_image(core, tile, arrays.history, run.result.targets.color, [&](std::span<const float> pixel) {
      return taa.history.coder.code({pixel[0], pixel[1], pixel[2], pixel[3]});
    });
  };
  pass.loads = &taa.source;
  pass.share = [&arrays, tiles, for_each_read](WorkRecorder::Round& round) {
    for_each_read([&](const StoredArray& array) { move_all(round, tiles, array, false); });
    move_all(round, tiles, arrays.history, true);
  };
  return pass;
}

ImagePass bloom_pass(const ViewRun& run, const OrderedTiles& tiles, const BloomStep& step, std::vector<Image>& images) {
  const Bloom& bloom = *run.bloom;
  std::vector<StoredArray>& levels = run.arrays->bloom;
  ImagePass pass{.name = step.name, .stage = "bloom"};
  // A step up stores the level that it reads; a copy knows what was stored before.
  const auto before = std::make_shared<StoredArray>();
  pass.begin = [&run, &bloom, &step, &images, &levels, before] {
    if (step.up) *before = levels[step.level];
    bloom.run(step, run.result.targets.color, images);
  };
  const auto for_each_read = [&step, &levels, before](const auto& visit) {
    if (step.up) visit(levels[step.level + 1]), visit(*before);
    if (!step.up && step.level > 0) visit(levels[step.level - 1]);
  };
  pass.work = [&run, &bloom, &step, &images, &levels, tiles, for_each_read](TileCore& core, binner::TileIndex tile) {
    core.run_image_shader(run.job, tilecore::pixel_count(bloom.part(bloom.size(step.level), tiles.grid.pixels(tile))),
                          step.up ? kUp : kDown);
    for_each_read([&](const StoredArray& array) { core.count(array.load(tile)); });
    store_image(core, tile, levels[step.level], images[step.level],
                [&](std::span<const float> light) { return bloom.code(light); });
  };
  pass.loads = !step.up && step.level == 0 ? &bloom.source() : nullptr;
  pass.share = [&step, &levels, tiles, for_each_read](WorkRecorder::Round& round) {
    for_each_read([&](const StoredArray& array) { move_all(round, tiles, array, false); });
    move_all(round, tiles, levels[step.level], true);
  };
  return pass;
}

ImagePass copy_pass(const ViewRun& run, const OrderedTiles& tiles, const CopyPass& copy, const Image* bloom) {
  ImagePass pass{.name = copy.name, .stage = "copy", .copy = &copy};
  pass.work = [&run, &copy, tiles, bloom](TileCore& core, binner::TileIndex tile) {
    if (bloom != nullptr) {
      core.count(run.arrays->bloom[0].load(tile));
      add_bloom(run, tiles.grid.pixels(tile), *bloom);
      core.run_image_shader(run.job, tilecore::pixel_count(tiles.grid.pixels(tile)), kMix);
    }
    core.copy(run.job, tile, copy.source.samples, copy.actions, run.result.targets);
  };
  if (bloom != nullptr)
    pass.share = [&run, tiles](WorkRecorder::Round& round) { move_all(round, tiles, run.arrays->bloom[0], false); };
  return pass;
}

}  // namespace tessera::gpu
