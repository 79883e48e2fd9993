#pragma once

#include <memory>
#include <vector>

#include "base/ktx2/ktx2.h"
#include "scene/capture.h"

namespace tessera::scene {

// Textures of KTX2 images.
//
// Invariants (cited by the tests):
//   BT1  A texture has the file's levels bit by bit; the other levels are made only where the file has a single one.
//   BT2  Its transfer function is the file's, its blocks are the target's.
//   BT3  Heights are level 0's red channel; their coarser levels are means, which bounds of slopes rely on.
std::shared_ptr<const shaders::Texture> basis_texture(ktx2::BasisTexture unpacked);
std::shared_ptr<const shaders::ScalarTexture> basis_heights(const ktx2::BasisTexture& unpacked);

}  // namespace tessera::scene
