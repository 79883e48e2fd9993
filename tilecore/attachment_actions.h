#pragma once

#include <cstdint>
#include <optional>

#include "tilecore/resolve/frame_format.h"

namespace tessera::tilecore {

// An attachment of colours in memory, tile by tile: its format, and where it begins within what attachments have.
struct ColorAttachment {
  PixelCoder coder;
  std::uint64_t base = 0;
  // Colours stored of each pixel: 1, the mean of its samples, or every sample, each rounded to the format. A pass that
  // loads all samples resolves them.
  int samples = 1;

  // Bytes of a pixel, all stored samples included.
  std::uint64_t pixel_bytes() const { return coder.pixel_bytes() * static_cast<std::uint64_t>(samples); }
};

// What the tiles of a pass load before they draw, and what they store. By default they load nothing and store their
// colours into the frame.
struct AttachmentActions {
  bool load_color = false;               // what lies where the pass stores its colours
  std::optional<ColorAttachment> color;  // where it stores them; none: into the frame
  std::uint64_t depth_bytes = 0;         // stored of each pixel's depths; 0: they are discarded
  std::uint64_t depth_base = 0;          // where these begin within what attachments have

  bool any() const { return load_color || color || depth_bytes > 0; }
};

}  // namespace tessera::tilecore
