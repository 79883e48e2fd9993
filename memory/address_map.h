#pragma once

#include <array>
#include <cstdint>

#include "base/round_up.h"
#include "memory/ledger.h"

namespace tessera::memory {

// Where the buffers of a replay lie in the emulated memory: one behind the other, each on a multiple of 1 MiB, the
// parameter buffer last because it alone may grow (parameter_buffer.full_policy = spill). Bases do not change from
// frame to frame.
//
// Invariants (cited by the tests):
//   AM1  Buffers do not overlap as long as each keeps within its size.
class AddressMap {
 public:
  struct Sizes {
    std::uint64_t patch_data = 0, attributes = 0, textures = 0, frame_buffer = 0;  // bytes
    std::uint64_t tiles = 0, tile_state = 0;  // tiles; most bytes of the state of one
    std::uint64_t signatures = 0, scene_color = 0;
  };
  explicit AddressMap(const Sizes& sizes) : tile_state_((sizes.tile_state + 255) / 256 * 256) {
    std::array<std::uint64_t, kPurposeCount> bytes;
    bytes.fill(kOtherBytes);
    const auto of = [&](Purpose purpose) -> std::uint64_t& { return bytes[static_cast<std::size_t>(purpose)]; };
    of(Purpose::kPatchData) = sizes.patch_data;
    of(Purpose::kAttributes) = sizes.attributes;
    of(Purpose::kTexture) = sizes.textures;
    of(Purpose::kFrameBuffer) = sizes.frame_buffer;
    of(Purpose::kSignatures) = sizes.signatures;
    of(Purpose::kSceneColor) = sizes.scene_color;
    of(Purpose::kTileState) = sizes.tiles * tile_state_;
    std::uint64_t next = 0;
    for (std::size_t p = 0; p < kPurposeCount; ++p) {
      if (static_cast<Purpose>(p) == Purpose::kTileQueue) continue;
      base_[p] = next;
      next += round_up(bytes[p], kAlignment);
    }
    base_[static_cast<std::size_t>(Purpose::kTileQueue)] = next;
  }

  std::uint64_t base(Purpose purpose) const { return base_[static_cast<std::size_t>(purpose)]; }
  // Of an access that a tile (any, where it is none's) caused: states of tiles have a place of their own each.
  std::uint64_t address(const Access& access, std::uint64_t tile) const {
    return base(access.purpose) + access.offset + (access.purpose == Purpose::kTileState ? tile * tile_state_ : 0);
  }

 private:
  static constexpr std::uint64_t kAlignment = std::uint64_t{1} << 20, kOtherBytes = std::uint64_t{64} << 20;

  std::uint64_t tile_state_;
  std::array<std::uint64_t, kPurposeCount> base_{};
};

}  // namespace tessera::memory
