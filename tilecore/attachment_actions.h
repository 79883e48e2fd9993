#pragma once

#include <cstdint>
#include <optional>

#include "tilecore/resolve/frame_format.h"

namespace tessera::tilecore {

// An attachment of colours in memory, tile by tile: its format, and its base address within the memory of attachments.
struct ColorAttachment {
  PixelCoder coder;
  std::uint64_t base = 0;
  // Colours stored of each pixel: 1, the mean of its samples, or every sample, each rounded to the format. A pass that
  // loads all samples resolves them.
  int samples = 1;
  // Its place in TileJob::attachments, which say how it is compressed and which tiles stay unwritten; negative: in none, as it
  // is the history of temporal antialiasing.
  int number = -1;

  // Bytes of a pixel, all stored samples included.
  std::uint64_t pixel_bytes() const { return coder.pixel_bytes() * static_cast<std::uint64_t>(samples); }
};

// Loads of a pass's tiles before they draw, and their stores. By default they load nothing and store their colours into
// the frame.
struct AttachmentActions {
  bool load_color = false;               // the present colours at the place of its store
  std::optional<ColorAttachment> color;  // destination of its colours; nullopt: the frame
  std::uint64_t depth_bytes = 0;         // bytes stored for each pixel's depths; 0: depths are discarded
  int depth_samples = 1;                 // depths stored of each pixel
  std::uint64_t depth_base = 0;          // base address of the depths within the memory of attachments
  std::uint64_t velocity_bytes = 0;      // bytes stored for each pixel's velocity; 0: there are no velocities
  std::uint64_t velocity_base = 0;       // base address of the velocities within the memory of attachments

  bool any() const { return load_color || color || depth_bytes > 0 || velocity_bytes > 0; }
};

}  // namespace tessera::tilecore
