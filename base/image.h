#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tessera {

// An image of interleaved channels, row by row from the top left. T is float (linear light) or an integer type.
template <class T>
struct ImageOf {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<T> values;  // height * width * channels

  ImageOf() = default;
  ImageOf(int width_in, int height_in, int channels_in)
      : width(width_in),
        height(height_in),
        channels(channels_in),
        values(static_cast<std::size_t>(width_in) * static_cast<std::size_t>(height_in) *
               static_cast<std::size_t>(channels_in)) {}

  std::size_t index(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
           static_cast<std::size_t>(channels);
  }
  // The channels of one pixel.
  std::span<T> at(int x, int y) { return {values.data() + index(x, y), static_cast<std::size_t>(channels)}; }
  std::span<const T> at(int x, int y) const {
    return {values.data() + index(x, y), static_cast<std::size_t>(channels)};
  }
  bool same_shape(const ImageOf& other) const {
    return width == other.width && height == other.height && channels == other.channels;
  }
};

using Image = ImageOf<float>;
using Image8 = ImageOf<std::uint8_t>;
using Image16 = ImageOf<std::uint16_t>;

}  // namespace tessera
