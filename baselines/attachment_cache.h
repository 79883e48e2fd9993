#pragma once

#include <cstdint>
#include <vector>

namespace tessera::baselines {

// An attachment of an immediate-mode machine, behind a set-associative write-back cache of lines of one burst: the depths
// of a shadow map, which are read before they are tested. The least recently used line of a set goes first; line n belongs
// to set n modulo the number of sets. A line has a mask of changed bytes, so that a store reads nothing. A line that was
// never written back is known to be clear and is not read.
//
// A pass that writes each line of an attachment once and whole moves the bytes of the attachment with any size of the
// cache (AC2, AC3): such passes store as many bytes as tiles do.
//
// Configured by baselines.cache_bytes, memory.burst_bytes.
//
// Invariants (cited by the tests):
//   AC1  Every line that is read was written back before.
//   AC2  A changed line is written back exactly once after its last change, when it leaves or at the end.
//   AC3  A line hits exactly when fewer lines of its set than the set has ways were used since it was; a cache without
//        room for a line never hits.
class AttachmentCache {
 public:
  static constexpr std::uint64_t kWays = 16;  // [assumed] as the L2

  // `line_count`: lines of the attachment, in bursts.
  AttachmentCache(std::uint64_t cache_bytes, std::uint64_t burst_bytes, std::uint32_t line_count);

  // Reads a line, and then changes it if `change` is set. Lines are numbers below `line_count`.
  void load(std::uint32_t line, bool change = false) { use(line, true, change); }
  // Changes a line without reading it.
  void store(std::uint32_t line) { use(line, false, true); }
  // Writes back all changed lines.
  void finish();

  std::uint64_t bytes_read() const { return bytes_read_; }
  std::uint64_t bytes_written() const { return bytes_written_; }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Way {
    std::uint32_t line = kNone;
    bool changed = false;
  };
  void use(std::uint32_t line, bool read, bool change);
  void write_back(std::uint32_t line);

  std::uint64_t burst_bytes_, sets_ = 0;
  std::size_t ways_ = 0;
  std::vector<Way> lines_;  // set by set, newest first
  std::vector<bool> in_memory_;
  std::uint64_t bytes_read_ = 0, bytes_written_ = 0;
};

}  // namespace tessera::baselines
