#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Line numbers of the records that the front end reads. The records lie back to back, each begins a line, and each has
// room for both motion keys if its vertices may move.
class RecordLines {
 public:
  // Throws LimitError where the records have more than 2^31 lines.
  RecordLines(const scene::FrameGeometry& frame, std::uint64_t line_bytes);

  // The first line of a record (Assembly::record_of()).
  std::uint32_t first(std::uint32_t record) const { return first_[record]; }
  std::uint32_t end() const { return first_.back(); }

 private:
  std::vector<std::uint32_t> first_;  // by record; the last is the end of all
};

// A record and the bytes of it that are read.
struct RecordRead {
  std::uint32_t record;
  std::uint64_t bytes;
};

}  // namespace tessera::frontend
