#pragma once

#include <cstdint>

#include "base/counter.h"
#include "base/rect.h"
#include "scene/frame_geometry.h"
#include "shaders_cpp/radiance_image.h"

namespace tessera::tilecore {

// Transmissive surfaces are drawn in a second pass over an image of everything else: its pixels before blending,
// written by the tiles in a first pass, and smaller levels of them, each half as wide and high, which rough surfaces
// look up. Tiles with a transmissive surface are rendered from their lists again, because storing and loading their
// samples takes more: 40 bytes a sample, against the few bytes of lists and patch records for a pixel.
//
// Invariants (cited by the tests):
//   TR1  The image, and so the frame, is the same for any tile size, tile order and number of threads.
//   TR2  A frame without transmissive surfaces is rendered in one pass, without the image.

// Whether a surface shows the surfaces behind it. Surfaces of procedures do not.
inline bool transmits(const scene::Drawable& drawable, const scene::Material& material) {
  return drawable.kind != scene::Primitive::Kind::kProcedure && material.has(scene::MaterialEffect::kTransmission);
}
inline bool transmits(const scene::PosedDrawable& drawable) {
  return transmits(*drawable.drawable, *drawable.material);
}

// Counters of transmission beside its passes.
struct TransmissionCounters {
  std::uint64_t pixels_kept = 0;
  std::uint64_t texels_reduced = 0;
  std::uint64_t tiles_again = 0;
};

// Texels of a level that a tile makes: the texels whose area begins in it. `pixels`: of the tile.
inline IntRect reduced_by(const shaders::RadianceImage& image, int level, IntRect pixels) {
  const auto first = [](int pixel, int texels, int all) {
    return static_cast<int>((std::int64_t{pixel} * texels + all - 1) / all);
  };
  const int width = image.width(level), height = image.height(level);
  return {first(pixels.x0, width, image.width()), first(pixels.y0, height, image.height()),
          first(pixels.x1, width, image.width()), first(pixels.y1, height, image.height())};
}

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::TransmissionCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::TransmissionCounters> =
    std::to_array<CounterField<tilecore::TransmissionCounters>>({
        {"transmission.pixels_kept", &tilecore::TransmissionCounters::pixels_kept, Combine::kSum, "pixels",
         "Pixels resolved, before blending, for the image behind transmissive surfaces.", ""},
        {"transmission.texels_reduced", &tilecore::TransmissionCounters::texels_reduced, Combine::kSum, "texels",
         "Texels of that image that were added up to make the level below.", ""},
        {"transmission.tiles_again", &tilecore::TransmissionCounters::tiles_again, Combine::kSum, "tiles",
         "Tiles that were rendered in both passes, because a transmissive surface may touch them.", ""},
    });
TESSERA_COUNTERS_COVER(tilecore::TransmissionCounters);

}  // namespace tessera
