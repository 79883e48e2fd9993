#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/pack/primitive_writer.h"

namespace tessera::replay {

// Edits that `tessera pack` makes to the surfaces of an asset before it compresses them.
struct SurfaceOptions {
  std::optional<int> subdivide;          // levels: meshes of triangles become cages (TESSERA_subdivision)
  std::optional<double> crease_degrees;  // edges of these meshes that are bent by more become infinitely sharp
  bool convert = false;                  // cages become Bezier patches
  struct Displace {
    std::string heights;  // an image file, the number of a texture, or the role of a material's own texture
    std::optional<double> scale, bias;  // object units; no scale: 2 % of the largest extent
  };
  std::optional<Displace> displace;  // TESSERA_displacement for the materials of all cages and patches

  bool any() const { return subdivide || convert || displace; }
};

// "HEIGHTS[,SCALE[,BIAS]]". Throws UsageError.
SurfaceOptions::Displace parse_displace(const std::string& text);

struct SurfaceReport {
  std::size_t cages = 0, quads = 0, triangles = 0;  // marked cages, and their faces
  std::size_t patches = 0;                          // patches written
  std::size_t displaced_materials = 0;
  std::vector<std::string> notices;  // unchanged surfaces, and why
};

// Marks, converts and displaces surfaces, in this order. `asset` must hold a checked document; the result must be
// checked again. Throws UsageError where an option needs something that the asset lacks.
SurfaceReport edit_surfaces(EditedAsset& asset, const SurfaceOptions& options);

}  // namespace tessera::replay
