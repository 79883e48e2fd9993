#pragma once

#include <memory>

#include "base/image_codec.h"
#include "base/ktx2/ktx2.h"
#include "scene/capture.h"
#include "scene/gltf/place.h"
#include "scene/gltf/resources.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

// A texture, or heights, with mip levels, and the format in the file.
struct ColorImage {
  std::shared_ptr<const shaders::Texture> texture;
  TextureSource source;
};
struct HeightImage {
  std::shared_ptr<const shaders::ScalarTexture> texture;
  TextureSource source;
};
struct UnpackedBasis {
  ktx2::BasisTexture texture;  // plain RGBA8
  TextureSource source;
};

// Limits on decoding an image, and its place in the document.
struct ImageAccount {
  const ImageLimits& limits;
  MemoryBudget& budget;
  Place place;
};

// Decode the bytes of an image file and charge the unpacked image and its levels. Throw InputError at the place for
// bytes that are no such image, LimitError with the place for an image that is too large. May be called on any thread.
ColorImage read_color_image(Bytes bytes, shaders::ColorSpace space, const ImageAccount& account);
HeightImage read_height_image(Bytes bytes, const ImageAccount& account);
// Decodes KTX2. Charges for its texels and for its blocks, of which a replay may want both.
UnpackedBasis unpack_basis_image(Bytes bytes, const ImageAccount& account);

}  // namespace tessera::scene::gltf
