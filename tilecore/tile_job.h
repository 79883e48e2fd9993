#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "base/vec.h"
#include "binner/tile_grid.h"
#include "hardware/machine.h"
#include "scene/frame_geometry.h"
#include "tilecore/attachment_actions.h"
#include "tilecore/core_settings.h"
#include "tilecore/resolve/tile_store.h"
#include "tilecore/shading/depth_maps.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/shading/shading_settings.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/visibility_method.h"

namespace tessera::tilecore {

class ParameterMaps;

struct ResolveFrame;
struct VelocityAttachment;

// Effects whose general kernels run even if the scene does not ask for them or the front end found that they can be
// left out.
struct ForcedEffects {
  bool motion = false, lens = false, displacement = false, alpha_test = false;
};

// Everything that the tile cores of one frame share; read only, except for `velocities` and the targets of `resolve`.
struct TileJob {
  const scene::FrameGeometry* frame = nullptr;
  const binner::TileGrid* grid = nullptr;
  const SamplePattern* pattern = nullptr;
  const hardware::Machine* machine = &default_machine();
  CoreSettings core;
  ShadingSettings shading;
  ShadingCacheSettings shading_cache;
  TextureUnit::Settings textures;
  Lighting lighting;
  std::optional<Vec3> background;  // nullopt: the environment
  ForcedEffects forced;
  // The kernels of a benchmark whose patches all have one set of effects (VisibilitySettings); nullptr: each its own.
  const VisibilityKernels* kernels = nullptr;
  const ParameterMaps* procedures = nullptr;      // cells that the sampling controller draws; nullptr: none
  FrameStore store;                               // storage of finished pixels
  AttachmentActions actions;                      // loads of tiles before they draw, and their stores
  VelocityAttachment* velocities = nullptr;       // that finished tiles fill; nullptr: no pass reads velocities
  std::span<const FrameStore> attachments;        // storage of attachments of colours, by number
  ResolveFrame* resolve = nullptr;                // desampling; nullptr: every pixel is shaded
  shaders::RadianceImage* scene_color = nullptr;  // lighting.behind's image, to be filled; nullptr: nothing transmits
  // A pass that draws depths alone, one sample a texel, stores them here and shades nothing. nullptr: colours are made.
  DepthMaps* depths = nullptr;
  bool depths_alone = false;  // a baseline's prepass: opaque surfaces leave their depths, and nothing is shaded
  // A baseline's frame in which surfaces transmit: tiles that show such a surface, which two passes draw. nullptr: one pass
  // draws all tiles.
  const std::vector<bool>* open = nullptr;
  bool behind =
      false;  // with `open`: this is the first pass, which draws the other surfaces and finishes the other tiles
  std::uint64_t maps_signature = 0;  // of all maps of lighting.shadows, if tiles may be eliminated
  int depth_layer = 0;
  bool pixel_ids = false;  // FrameTargets::ids are requested
  bool spills = false;     // samples that the tile memory has no room for go to memory and back

  bool shades() const { return depths == nullptr && !depths_alone; }
  // Whether the pass draws a tile, and whether it gives the colours of a tile.
  bool draws(std::size_t tile) const { return open == nullptr || behind || (*open)[tile]; }
  bool finishes(std::size_t tile) const { return open == nullptr || (*open)[tile] != behind; }
  // Whether tiles store a G-buffer, which a pass of its own lights.
  bool stores_gbuffer() const { return shades() && shading.path == ShadingPath::kGbufferExternal; }
  std::uint64_t burst_bytes() const { return static_cast<std::uint64_t>(machine->memory.burst_bytes); }
  std::uint64_t line_bytes() const { return static_cast<std::uint64_t>(machine->line_bytes()); }
  std::size_t warp_lanes() const { return static_cast<std::size_t>(machine->shader.warp_lanes); }
  // Storage of an attachment; nullptr: it is a history, which the pass over the image stores.
  const FrameStore* store_of(const ColorAttachment& attachment) const {
    return attachment.number < 0 ? nullptr : &attachments[static_cast<std::size_t>(attachment.number)];
  }
  std::size_t blend_layers() const { return static_cast<std::size_t>(core.blend_layers); }

 private:
  static const hardware::Machine& default_machine() {
    static const hardware::Machine kMachine;
    return kMachine;
  }
};

// Whether a surface may be seen away from its place at shutter open through a pinhole; the state then keeps that place.
inline bool sees_rest(const TileJob& job) {
  return job.frame->any_motion || job.frame->projection.lens_scale != 0 || job.forced.motion || job.forced.lens;
}

// The room that samples take in the tile memory in this frame.
inline SampleLayout sample_layout(const TileJob& job) {
  return {job.core.weight_bits, job.procedures != nullptr, sees_rest(job), job.depths != nullptr,
          job.shading.gbuffer_bytes()};
}

}  // namespace tessera::tilecore
