#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace tessera::memory {

// Units that reach external memory, and the purposes of their traffic. A pair that never moved a byte is not reported.
enum class Unit : std::uint8_t { kFrontend, kBinner, kTilecore, kResolve, kSampling };
enum class Purpose : std::uint8_t {
  kPatchData,
  kTileQueue,
  kTileState,
  kFrameBuffer,
  kTexture,
  kHistory,
  kNeighbours,
  kSamplingMaps,
  kAttributes,
  kCoarseDepth,
  kSignatures,
  kSceneColor,
  kShadowMap,
  kAttachment
};

inline constexpr std::size_t kUnitCount = 5;
inline constexpr std::size_t kPurposeCount = 14;

std::string_view name(Unit unit);
std::string_view name(Purpose purpose);
std::string_view meaning(Purpose purpose);

struct Traffic {
  std::uint64_t read_bytes = 0;
  std::uint64_t written_bytes = 0;
};

// One transfer over the external interface, in whole bursts. `offset` counts from the start of its purpose's memory.
struct Access {
  std::uint64_t offset = 0, bytes = 0;
  Unit unit = Unit::kFrontend;
  Purpose purpose = Purpose::kPatchData;
  bool write = false;
};

// The transfers of a ledger in the order in which they were charged. A transfer without an offset lies directly after
// the preceding transfer of the same purpose.
class AccessLog {
 public:
  void add(Unit unit, Purpose purpose, bool write, std::uint64_t offset, std::uint64_t bytes) {
    if (bytes > 0) accesses_.push_back({offset, bytes, unit, purpose, write});
    next_[static_cast<std::size_t>(purpose)] = offset + bytes;
  }
  void add_next(Unit unit, Purpose purpose, bool write, std::uint64_t bytes) {
    add(unit, purpose, write, next_[static_cast<std::size_t>(purpose)], bytes);
  }

  std::vector<Access>& accesses() { return accesses_; }
  const std::vector<Access>& accesses() const { return accesses_; }

 private:
  std::vector<Access> accesses_;
  std::array<std::uint64_t, kPurposeCount> next_{};
};

// The account of every byte that crosses the external memory interface, by unit and purpose. A value: each unit
// instance keeps its own, and they are added up in a fixed order.
//
// Contract: the unit that moves the bytes calls read() or write() at the moment it moves them, with the number of
// bytes on the bus (whole bursts).
class Ledger {
 public:
  void read(Unit unit, Purpose purpose, std::uint64_t bytes) {
    at(unit, purpose).read_bytes += bytes;
    if (log_ != nullptr) log_->add_next(unit, purpose, false, bytes);
  }
  void write(Unit unit, Purpose purpose, std::uint64_t bytes) {
    at(unit, purpose).written_bytes += bytes;
    if (log_ != nullptr) log_->add_next(unit, purpose, true, bytes);
  }
  // Charges all bursts that the bytes [offset, offset + bytes) touch.
  void read_at(Unit unit, Purpose purpose, std::uint64_t offset, std::uint64_t bytes, std::uint64_t burst) {
    move_at(unit, purpose, false, offset, bytes, burst);
  }
  void write_at(Unit unit, Purpose purpose, std::uint64_t offset, std::uint64_t bytes, std::uint64_t burst) {
    move_at(unit, purpose, true, offset, bytes, burst);
  }

  // Logs every transfer from now on; nullptr stops logging. `log` must outlive the ledger or the next call.
  void record_into(AccessLog* log) { log_ = log; }

  const Traffic& traffic(Unit unit, Purpose purpose) const { return const_cast<Ledger*>(this)->at(unit, purpose); }
  Traffic total() const;
  // Adds the sums; logs do not change.
  Ledger& operator+=(const Ledger& other);
  // Subtracts sums that are part of this ledger's.
  Ledger& operator-=(const Ledger& other);

 private:
  Traffic& at(Unit unit, Purpose purpose) {
    return traffic_[static_cast<std::size_t>(unit)][static_cast<std::size_t>(purpose)];
  }
  void move_at(Unit unit, Purpose purpose, bool write, std::uint64_t offset, std::uint64_t bytes, std::uint64_t burst);

  std::array<std::array<Traffic, kPurposeCount>, kUnitCount> traffic_{};
  AccessLog* log_ = nullptr;
};

// Bytes on the bus for `bytes` bytes at `address`: whole bursts, since the interface moves nothing smaller.
constexpr std::uint64_t burst_bytes(std::uint64_t address, std::uint64_t bytes, std::uint64_t burst) {
  if (bytes == 0) return 0;
  return ((address + bytes - 1) / burst - address / burst + 1) * burst;
}

}  // namespace tessera::memory
