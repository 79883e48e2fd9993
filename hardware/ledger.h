#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tessera::hardware {

// The units that reach external memory, and what for. A pair that never moved a byte is not reported.
enum class Unit : std::uint8_t { kFrontend, kBinner, kTilecore, kResolve, kSampling };
enum class Purpose : std::uint8_t { kPatchData, kTileQueue, kTileState, kFrameBuffer, kSamplingMaps };

inline constexpr std::size_t kUnitCount = 5;
inline constexpr std::size_t kPurposeCount = 5;

std::string_view name(Unit unit);
std::string_view name(Purpose purpose);
std::string_view meaning(Purpose purpose);

struct Traffic {
  std::uint64_t read_bytes = 0;
  std::uint64_t written_bytes = 0;
};

// The account of every byte that crosses the external memory interface, by unit and purpose. A value: each unit
// instance keeps its own, and they are added up in a fixed order.
//
// Contract: the unit that moves the bytes calls read() or write() at the moment it moves them, with the number of
// bytes on the bus (whole bursts).
class Ledger {
 public:
  void read(Unit unit, Purpose purpose, std::uint64_t bytes) { at(unit, purpose).read_bytes += bytes; }
  void write(Unit unit, Purpose purpose, std::uint64_t bytes) { at(unit, purpose).written_bytes += bytes; }

  const Traffic& traffic(Unit unit, Purpose purpose) const { return const_cast<Ledger*>(this)->at(unit, purpose); }
  Traffic total() const;
  Ledger& operator+=(const Ledger& other);

 private:
  Traffic& at(Unit unit, Purpose purpose) {
    return traffic_[static_cast<std::size_t>(unit)][static_cast<std::size_t>(purpose)];
  }
  std::array<std::array<Traffic, kPurposeCount>, kUnitCount> traffic_{};
};

// Bytes on the bus for `bytes` bytes at `address`: whole bursts, as the interface moves nothing smaller.
constexpr std::uint64_t burst_bytes(std::uint64_t address, std::uint64_t bytes, std::uint64_t burst) {
  if (bytes == 0) return 0;
  return ((address + bytes - 1) / burst - address / burst + 1) * burst;
}

}  // namespace tessera::hardware
