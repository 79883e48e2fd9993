#include "frontend/settings.h"

namespace tessera::frontend {

Keys<Settings> settings_keys() {
  return {
      {"frontend.bound_method", &Settings::bound_method,
       "Method that boxes sub-patches: object axes or the patch's own, displaced in every direction (aabb, obb) or "
       "along bounded normals (tpatch, npatch), or interval arithmetic.",
       "[spec] Munkberg et al. 2010 for obb, tpatch and npatch"},
      {"frontend.split_criterion", &Settings::split_criterion,
       "Criterion that chooses the sub-patches that are split further, and their order.", "[assumed]"},
      {"frontend.split_pixels", &Settings::split_pixels, "pixels", 1, 65536,
       "Sub-patches no wider than this on screen, at shutter open and close, are not split further.",
       "[measured] docs/bounds_and_binning.md: four tiles"},
      {"frontend.split_depth", &Settings::split_depth, "splits", 0, 12,
       "Most splits by the criterion between a base patch and a sub-patch; splits for tessellator.sub_patch_cells do "
       "not count.",
       "[assumed]"},
      {"frontend.split_budget", &Settings::split_budget, "sub-patches", 1, 4096,
       "Most sub-patches that the criterion may make of one base patch.", "[assumed]"},
      {"frontend.backface_culling", &Settings::backface_culling,
       "Whether sub-patches that face away are dropped before binning.",
       "[spec] every GPU culls back faces; before tessellation: Hasselgren et al. 2009"},
      {"frontend.previous_depth_culling", &Settings::previous_depth_culling,
       "Whether instances and groups of patches that the previous frame's depths hide are deferred, tested again when "
       "the tiles are done, and rendered in a second pass if they were visible after all.",
       "[assumed] two-pass occlusion culling, Haar and Aaltonen 2015"},
  };
}

}  // namespace tessera::frontend
