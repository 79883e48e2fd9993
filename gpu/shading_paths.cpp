#include "gpu/shading_paths.h"

#include <array>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::gpu {

void check_shading_path(const GpuConfiguration& gpu, const RunSettings& settings, bool transmits) {
  using Path = tilecore::ShadingPath;
  const Path path = settings.shading.path;
  if (path == Path::kVisibility) return;
  const bool again = path == Path::kPrepass || path == Path::kGbufferExternal;  // a second pass over all tiles
  struct Conflict {
    bool there;
    const char *with, *because;
  };
  const std::array<Conflict, 5> conflicts = {{
      {settings.shading.has_gbuffer() && settings.shading.rate == tilecore::ShadingRate::kCache, "shading.rate=cache",
       "cells of surfaces have no samples to leave their materials in"},
      {path == Path::kGbufferExternal && settings.resolve.desampling != tilecore::Desampling::kOff,
       "resolve.desampling", "pixels that are shaded after all have lost their visibility records"},
      {again && transmits, "surfaces that transmit", "what is behind them is a pass of its own"},
      {again && gpu.frontend.previous_depth_culling, "frontend.previous_depth_culling=true",
       "it has two passes already"},
      {again && gpu.tile.rendering_elimination, "tile.rendering_elimination=true",
       "a tile's inputs are those of one pass"},
  }};
  for (const Conflict& conflict : conflicts)
    if (conflict.there)
      throw UsageError(fmt::format("shading.path={} with {}: {}", kEnumWords<Path>[static_cast<std::size_t>(path)],
                                   conflict.with, conflict.because));
}

}  // namespace tessera::gpu
