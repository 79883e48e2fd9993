#include "memory/ledger.h"

namespace tessera::memory {

std::string_view name(Unit unit) {
  static constexpr std::array<std::string_view, kUnitCount> kNames = {"frontend", "binner", "tilecore", "resolve",
                                                                      "sampling"};
  return kNames[static_cast<std::size_t>(unit)];
}

std::string_view name(Purpose purpose) {
  static constexpr std::array<std::string_view, kPurposeCount> kNames = {
      "patch_data",    "tile_queue", "tile_state",   "frame_buffer", "texture",     "history",    "neighbours",
      "sampling_maps", "attributes", "coarse_depth", "signatures",   "scene_color", "shadow_map", "attachment"};
  return kNames[static_cast<std::size_t>(purpose)];
}

std::string_view meaning(Purpose purpose) {
  static constexpr std::array<std::string_view, kPurposeCount> kMeanings = {
      "control points and cluster vertices of base patches, numbers of procedures",
      "tile lists in the parameter buffer: list heads, chunk links and entries",
      "samples of unfinished tiles, stored and reloaded around a partial render",
      "finished pixels",
      "lines of textures, and of the front end's tables of their heights, that missed the caches",
      "history of the resolve unit for the next frame: colours read again, depths and surfaces, regimes of blocks",
      "pixels of neighbouring tiles that stencils reach into, in a second pass",
      "parameter map and rate map of procedures",
      "records of base patches and further vertex attributes for the pixel shader, by lines of the L2; records of "
      "lights, where tiles have light lists",
      "farthest depths of blocks, by which the next frame's front end culls, and deferred patches",
      "signatures of tiles' colours or inputs",
      "the scene-color image behind transmitting surfaces and its mip chain, as they are made; reads of them count as "
      "textures",
      "depths of shadow maps, and flags of their empty tiles: written by their passes, read through the texture units",
      "images that one pass of the capture stores and another loads, and depths that it requests to store"};
  return kMeanings[static_cast<std::size_t>(purpose)];
}

Traffic Ledger::total() const {
  Traffic sum;
  for (const auto& unit : traffic_)
    for (const Traffic& t : unit) {
      sum.read_bytes += t.read_bytes;
      sum.written_bytes += t.written_bytes;
    }
  return sum;
}

Ledger& Ledger::operator+=(const Ledger& other) {
  for (std::size_t u = 0; u < kUnitCount; ++u)
    for (std::size_t p = 0; p < kPurposeCount; ++p) {
      traffic_[u][p].read_bytes += other.traffic_[u][p].read_bytes;
      traffic_[u][p].written_bytes += other.traffic_[u][p].written_bytes;
    }
  return *this;
}

Ledger& Ledger::operator-=(const Ledger& other) {
  for (std::size_t u = 0; u < kUnitCount; ++u)
    for (std::size_t p = 0; p < kPurposeCount; ++p) {
      traffic_[u][p].read_bytes -= other.traffic_[u][p].read_bytes;
      traffic_[u][p].written_bytes -= other.traffic_[u][p].written_bytes;
    }
  return *this;
}

void Ledger::move_at(Unit unit, Purpose purpose, bool write, std::uint64_t offset, std::uint64_t bytes,
                     std::uint64_t burst) {
  const std::uint64_t moved = burst_bytes(offset, bytes, burst);
  Traffic& traffic = at(unit, purpose);
  (write ? traffic.written_bytes : traffic.read_bytes) += moved;
  if (log_ != nullptr) log_->add(unit, purpose, write, offset / burst * burst, moved);
}

}  // namespace tessera::memory
