#pragma once

#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "binner/tile_grid.h"
#include "scene/frame_geometry.h"
#include "tilecore/resolve/tile_store.h"
#include "tilecore/shading/pixel_shader.h"
#include "tilecore/shading/shading_settings.h"
#include "tilecore/shading/texture_unit.h"
#include "tilecore/visibility/sample_pattern.h"
#include "tilecore/visibility/visibility_method.h"

namespace tessera::tilecore {

class ParameterMaps;

struct ResolveFrame;

// Everything that the tile cores of one frame share; read only but for what `resolve` says.
struct TileJob {
  const scene::FrameGeometry* frame = nullptr;
  const binner::TileGrid* grid = nullptr;
  const SamplePattern* pattern = nullptr;
  Lighting lighting;
  Vec3 background{0.0f};
  bool has_background = false;  // else the environment
  ShadingRate shading = ShadingRate::kPixel;
  ShadingDerivatives derivatives = ShadingDerivatives::kAnalytic;
  float shading_cell_pixels = 1;
  std::size_t warp_lanes = 32;  // of the pixel shader
  std::size_t shading_cache_entries = 1024;
  std::size_t blend_layers = 8;  // of a sample, on chip; 1 to LayerMerger::kMaxCapacity
  bool cull_occlusion = true;
  // Run the general kernels also where the scene does not ask for them, or the front end found that they can be spared.
  bool force_motion = false, force_lens = false, force_displacement = false, force_alpha_test = false;
  VisibilityMethodSettings visibility;
  std::uint64_t burst_bytes = 64, line_bytes = 64;  // of the memory, of the L2
  TextureUnit::Settings textures;
  const VisibilityKernels* kernels =
      nullptr;  // see VisibilitySettings; for a benchmark whose patches all have one set of effects
  const ParameterMaps* procedures = nullptr;  // what the sampling controller draws, if anything
  FrameStore store;                           // of finished pixels
  ResolveFrame* resolve = nullptr;            // desampling; null: every pixel is shaded
  shaders::RadianceImage* behind = nullptr;   // as lighting.behind, to be filled; null: nothing transmits
};

// Whether anything may be seen elsewhere than where it rests: state then says where that is.
inline bool sees_rest(const TileJob& job) {
  return job.frame->any_motion || job.frame->projection.lens_scale != 0 || job.force_motion || job.force_lens;
}

}  // namespace tessera::tilecore
