#include "gpu/shading_paths.h"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::gpu {
namespace {

using Path = tilecore::ShadingPath;

std::string_view word_of(Path path) { return kEnumWords<Path>[static_cast<std::size_t>(path)]; }

struct NamedPath {
  Path path = Path::kVisibility;
  int bits = 0;  // of a sample of the G-buffer; 0: there is none
};

std::optional<NamedPath> named_path(const scene::PassGraph& graph) {
  std::optional<NamedPath> named;
  for (const scene::Pass& pass : graph.passes)
    for (const scene::Subpass& subpass : pass.subpasses) {
      if (subpass.shader == scene::PassShader::kDepth && !named) named = {Path::kPrepass, 0};
      if (subpass.shader != scene::PassShader::kGbuffer) continue;
      const bool on_chip = std::ranges::any_of(
          pass.subpasses, [](const scene::Subpass& other) { return other.shader == scene::PassShader::kLight; });
      named = {on_chip ? Path::kGbuffer : Path::kGbufferExternal, 0};
      for (const std::string& name : subpass.write)
        if (const scene::Attachment* color = graph.find(name);
            color != nullptr && !is_depth(color->format) && !is_velocity(graph, name))
          named->bits += sample_bits(color->format);
    }
  return named;
}

}  // namespace

RunSettings follow_passes(const scene::Capture& capture, RunSettings settings) {
  const std::optional<NamedPath> named = capture.settings.graph ? named_path(*capture.settings.graph) : std::nullopt;
  if (!named) return settings;
  if (settings.shading.path != Path::kVisibility && settings.shading.path != named->path)
    throw UsageError(fmt::format("shading.path={}: the passes of the capture shade along {}",
                                 word_of(settings.shading.path), word_of(named->path)));
  settings.shading.path = named->path;
  if (named->bits == 0) return settings;
  settings.shading.layout = tilecore::GbufferLayout::kPacked;
  settings.shading.gbuffer_bits = named->bits;
  return settings;
}

void check_shading_path(const GpuConfiguration& gpu, const RunSettings& settings, bool transmits) {
  if (settings.shading.gbuffer_bits % 32 != 0)
    throw UsageError(fmt::format("gbuffer.bits={} is no multiple of 32", settings.shading.gbuffer_bits));
  const Path path = settings.shading.path;
  if (path == Path::kVisibility) return;
  const bool again = path == Path::kPrepass || path == Path::kGbufferExternal;  // a second pass over all tiles
  struct Conflict {
    bool there;
    const char *with, *because;
  };
  const std::array<Conflict, 4> conflicts = {{
      {settings.shading.has_gbuffer() && settings.shading.rate == tilecore::ShadingRate::kCache, "shading.rate=cache",
       "cells of surfaces have no samples to leave their materials in"},
      {path == Path::kGbufferExternal && settings.resolve.desampling != tilecore::Desampling::kOff,
       "resolve.desampling", "pixels that are shaded after all have lost their visibility records"},
      {again && transmits, "surfaces that transmit", "what is behind them is a pass of its own"},
      {again && gpu.frontend.previous_depth_culling, "frontend.previous_depth_culling=true",
       "it has two passes already"},
  }};
  for (const Conflict& conflict : conflicts)
    if (conflict.there)
      throw UsageError(fmt::format("shading.path={} with {}: {}", word_of(path), conflict.with, conflict.because));
}

}  // namespace tessera::gpu
