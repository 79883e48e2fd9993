#include "hardware/ledger.h"

namespace tessera::hardware {

std::string_view name(Unit unit) {
  static constexpr std::array<std::string_view, kUnitCount> kNames = {"frontend", "binner", "tilecore", "resolve", "sampling"};
  return kNames[static_cast<std::size_t>(unit)];
}

std::string_view name(Purpose purpose) {
  static constexpr std::array<std::string_view, kPurposeCount> kNames = {"patch_data", "tile_queue", "tile_state",
                                                                         "frame_buffer", "sampling_maps"};
  return kNames[static_cast<std::size_t>(purpose)];
}

std::string_view meaning(Purpose purpose) {
  static constexpr std::array<std::string_view, kPurposeCount> kMeanings = {
      "control points and cluster vertices of base patches, numbers of procedures",
      "tile queues in the parameter buffer: list heads, chunk links and entries",
      "samples of unfinished tiles, stored and reloaded around a partial render",
      "finished pixels",
      "parameter map and rate map of procedures"};
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

}  // namespace tessera::hardware
