#include "gpu/image_bytes.h"

#include <algorithm>

namespace tessera::gpu {

std::uint64_t image_bytes(const RenderRequest& request, const RunSettings& settings, const GpuConfiguration& gpu,
                          const scene::Capture& capture) {
  const bool desampling = settings.resolve.desampling != tilecore::Desampling::kOff;
  const bool stereo = settings.stereo.eye_separation > 0;
  const unsigned ids = request.pixel_ids ? 16u : 0u;
  const unsigned before = (gpu.frame_buffer.transaction_elimination ? 16u : 0u) +
                          (gpu.tile.rendering_elimination ? (request.auxiliary ? 40u : 16u) + ids : 0u);
  const std::uint64_t per_pixel =
      (request.auxiliary ? 64u : 32u) + (request.resolve_auxiliary ? 28u : 0u) + (desampling ? 50u : 0u) + before + ids;
  // A prepass leaves the depths of all samples.
  const std::uint64_t depths = settings.shading.path == tilecore::ShadingPath::kPrepass
                                   ? 4 * static_cast<std::uint64_t>(settings.sampling.samples_per_pixel)
                                   : 0;
  // A G-buffer in memory keeps the size of each block of 64 samples, 2 bytes for each of at most 32 words.
  const std::uint64_t blocks = settings.shading.path == tilecore::ShadingPath::kGbufferExternal
                                   ? static_cast<std::uint64_t>(settings.sampling.samples_per_pixel)
                                   : 0;
  const bool transmits = std::any_of(capture.materials.begin(), capture.materials.end(), [](const scene::Material& m) {
    return m.has(scene::MaterialEffect::kTransmission);
  });
  const std::optional<scene::PassGraph>& graph = capture.settings.graph;
  const auto runs = [&](scene::PassShader shader) {
    return graph && std::ranges::any_of(graph->passes,
                                        [&](const scene::Pass& pass) { return pass.subpasses[0].shader == shader; });
  };
  // A history, the next one, velocities and depths.
  const unsigned histories = antialiases(capture, settings) ? 16 + 16 + 8 + 4 : 0;
  // The colours that signatures of attachments stand for.
  const std::uint64_t stored = gpu.frame_buffer.transaction_elimination && graph ? 16 * graph->attachments.size() : 0;
  return static_cast<std::uint64_t>(request.region.width()) * static_cast<std::uint64_t>(request.region.height()) *
         ((per_pixel + histories + stored) * (stereo ? 2 : 1) + (transmits ? 16u : 0u) +
          (runs(scene::PassShader::kBloom) ? 16u : 0u) + depths + blocks);
}

}  // namespace tessera::gpu
