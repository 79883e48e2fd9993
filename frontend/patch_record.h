#pragma once

#include <cstdint>

#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Bytes of a base patch's record in memory, which instances share: a header, then control points or cluster vertices at
// one or two motion keys, then the cells of a cluster. What the front end and every tile core that needs the patch fetch.
std::uint64_t patch_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch);

}  // namespace tessera::frontend
