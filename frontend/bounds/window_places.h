#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tessera::frontend {

// Lookups in window tables, one in each lane: the texels that a box of texture coordinates reads, and the windows that
// cover them.
inline constexpr std::size_t kMaxPlaces = 48;
template <class T>
using PlaceLanes = std::array<T, kMaxPlaces>;

struct PlaceAxis {
  PlaceLanes<float> low, high;           // coordinates
  PlaceLanes<std::int32_t> size;         // of the table, in texels
  PlaceLanes<std::int32_t> first, last;  // found: windows
  bool repeats = false;                  // whole periods do not count
};
struct WindowPlaces {
  PlaceAxis s, t;
  PlaceLanes<std::int32_t> steps;  // of the table
  PlaceLanes<std::int32_t> step;   // found
  // Nonzero if the texels lie inside the texture, in one piece; otherwise the other results are unset.
  PlaceLanes<std::int32_t> found;
};

void find_windows(WindowPlaces& places, std::size_t count);

}  // namespace tessera::frontend
