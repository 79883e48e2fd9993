#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"
#include "tilecore/tile_state.h"

namespace tessera::tilecore {

// Layers of procedures that blend. Neighbouring footprints overlap, so that a sample point may get a layer from each of
// them where its ray meets the surface once; what is opaque has the depth test for that.

// What SurfaceLocation::triangle says of such a layer until its tile is finished: its side, and its footprint's half steps
// in parameters of the piece, rounded up to powers of two. A location on the whole patch, but no name of one.
std::uint32_t layer_code(bool back, float half_u, float half_v);
inline bool is_layer_code(std::uint32_t triangle) { return triangle >= 0x80000000u && triangle < 0xFFFF0000u; }

// Makes one layer of those of a sample that lie on one side of one procedure within the footprints of each other, and of
// all that are linked so: the nearest, then that of the lowest patch and parameters. Parameters wrap where depths say so.
// The result does not depend on the order of the layers. Their triangles become names: one for each side of a patch and
// each eighth of its parameters, so that what blends over itself is shaded apart. Returns how many layers went.
std::size_t merge_procedure_layers(const scene::FrameGeometry& frame, std::vector<TileState::Layer>& layers);

}  // namespace tessera::tilecore
