#include "frontend/record_lines.h"

#include "base/error.h"
#include "frontend/patch_record.h"

namespace tessera::frontend {

RecordLines::RecordLines(const scene::FrameGeometry& frame, std::uint64_t line_bytes) {
  const scene::Assembly& assembly = *frame.assembly;
  first_.reserve(std::size_t{assembly.record_count} + 1);
  first_.push_back(0);
  std::uint64_t end = 0;
  for (const scene::Drawable& drawable : assembly.drawables) {
    if (drawable.first_record + 1 != first_.size()) continue;  // an instance whose records are there
    for (std::uint32_t p = drawable.first_patch; p < drawable.first_patch + drawable.patch_count; ++p) {
      const bool resting = resting_bound(frame, p) != nullptr;
      const std::uint64_t bytes =
          resting ? bound_record_bytes(frame, p) : patch_record_bytes(assembly, p, keeps_two_keys(assembly, drawable));
      end += (bytes + line_bytes - 1) / line_bytes;
      if (end >> 31 != 0) throw LimitError("records of base patches have more than 2^31 cache lines");
      first_.push_back(static_cast<std::uint32_t>(end));
    }
  }
}

}  // namespace tessera::frontend
