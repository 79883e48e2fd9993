#pragma once

#include <algorithm>
#include <cstdint>

#include "memory/ledger.h"
#include "tilecore/tile_job.h"

namespace tessera::baselines {

// The surfaces that a pass draws into, as conventional machines keep and store them.
struct PassSurfaces {
  std::uint64_t depth_bytes = 4;    // of a sample
  std::uint64_t color_bytes = 4;    // of a sample; 0: the pass draws depths alone
  std::uint64_t gbuffer_bytes = 0;  // of a sample; 0: draws of opaque surfaces give colours at once
  bool resolves_color = false;      // it stores fewer colours of a pixel than it draws, or other colours
  bool reads_color =
      false;  // drawn colours are read in the end, to resolve them or for the image behind other surfaces
  bool loads_color = false;    // the present colours are loaded before it draws
  bool keeps_samples = false;  // it stores all samples of an attachment
  // Raw bytes of a pixel in the surfaces that are stored with fewer samples than are drawn, beside the frame.
  std::uint64_t resolved_color_bytes = 0, resolved_depth_bytes = 0;

  // Bytes that a draw of an opaque surface leaves for a sample besides its depth.
  std::uint64_t drawn_bytes() const { return gbuffer_bytes > 0 ? gbuffer_bytes : color_bytes; }
  // Bytes of a sample in a tile: colours lie where the G-buffer was that they are made from.
  std::uint64_t sample_bytes() const { return depth_bytes + std::max(color_bytes, gbuffer_bytes); }
};

// The surfaces of a job. A shadow map has the depth of its format; frames have 4 bytes of depth and of colour, attachments and
// G-buffers the bytes of their format. A pass that stores its G-buffer stores no colours.
inline PassSurfaces surfaces_of(const tilecore::TileJob& job) {
  PassSurfaces out;
  if (!job.shades()) {
    if (job.depths != nullptr) out.depth_bytes = job.depths->texel_bytes();
    out.color_bytes = 0;
    return out;
  }
  const tilecore::AttachmentActions& actions = job.actions;
  const int samples = job.pattern->samples_per_pixel();
  out.gbuffer_bytes = job.shading.gbuffer_bytes();
  const bool lights = out.gbuffer_bytes > 0 && !job.stores_gbuffer();
  out.loads_color = actions.load_color && out.gbuffer_bytes == 0;
  if (!job.stores_gbuffer()) {
    out.resolves_color = lights || (samples > 1 && (!actions.color || actions.color->samples == 1));
    if (actions.color) {
      out.color_bytes = actions.color->coder.pixel_bytes();
      if (out.resolves_color) out.resolved_color_bytes = actions.color->pixel_bytes();
    }
    out.reads_color = out.resolves_color || job.behind;
  }
  if (actions.depth_bytes > 0 && actions.depth_samples < samples) out.resolved_depth_bytes = actions.depth_bytes;
  out.keeps_samples = job.stores_gbuffer() || (actions.color && !out.resolves_color) ||
                      (actions.depth_bytes > 0 && actions.depth_samples == samples);
  return out;
}

// Bytes of images that cores look up through their texture caches: textures, heights and shadow maps. They are the same for
// every scheme that shades only visible surfaces.
inline std::uint64_t looked_up_bytes(const memory::Ledger& ledger) {
  return ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kTexture).read_bytes +
         ledger.traffic(memory::Unit::kTilecore, memory::Purpose::kShadowMap).read_bytes;
}

}  // namespace tessera::baselines
