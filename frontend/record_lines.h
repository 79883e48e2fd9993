#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Where the records that the front end reads lie in memory, in lines: one behind the other, each from a line on, with room for
// both motion keys where vertices may move.
class RecordLines {
 public:
  // Throws LimitError where the records have more than 2^31 lines.
  RecordLines(const scene::FrameGeometry& frame, std::uint64_t line_bytes);

  // The first line of a record (Assembly::record_of()).
  std::uint32_t first(std::uint32_t record) const { return first_[record]; }
  std::uint32_t end() const { return first_.back(); }

 private:
  std::vector<std::uint32_t> first_;  // by record, and their end
};

// A record that is read whole.
struct RecordRead {
  std::uint32_t record;
  std::uint64_t bytes;
};

}  // namespace tessera::frontend
