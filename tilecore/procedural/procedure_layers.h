#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"
#include "tilecore/tile_state.h"

namespace tessera::tilecore {

// Layers of procedures that blend. Neighbouring footprints overlap, so a sample point may get a layer from each of them
// although its ray meets the surface once; for opaque surfaces the depth test removes the surplus.

// SurfaceLocation::triangle of such a layer until its tile is finished: its side, and its footprint's half steps in
// parameters of the piece, rounded up to powers of two. It gives a location on the whole patch, but does not name a
// surface.
std::uint32_t layer_code(bool back, float half_u, float half_v);
inline bool is_layer_code(std::uint32_t triangle) { return triangle >= 0x80000000u && triangle < 0xFFFF0000u; }

// Merges the layers of a sample that lie on one side of one procedure and, directly or through others, within each
// other's footprints: the nearest stays, or the one of the lowest patch and parameters. Parameters wrap if depths
// agree. The result does not depend on the order of the layers. Their triangles become names: one for each side of a
// patch and each eighth of its parameters, so that overlapping parts of a surface are shaded separately. Returns the
// number of removed layers.
std::size_t merge_procedure_layers(const scene::FrameGeometry& frame, std::vector<TileState::Layer>& layers);

}  // namespace tessera::tilecore
