#pragma once

#include <cstdint>
#include <vector>

#include "memory/line_cache.h"
#include "scene/frame_geometry.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "timing/events/memory_layout.h"

namespace tessera::gpu {

// Layout of the records of base patches (frontend/patch_record.h) for tile cores, in cache lines behind the textures.
// Records lie back to back without holes; instances share the records of their mesh. It finds the lines that
// tessellating or shading a patch reads: its record and its instance's.
class PatchTable {
 public:
  // `first_line`: the first free line. Records of lights take `light_bytes` behind the records of patches. Throws
  // LimitError if the lines do not end below kCellsAt.
  PatchTable(const scene::Assembly& assembly, std::int64_t line_bytes, std::uint64_t first_line,
             std::uint64_t light_bytes = 0);

  std::uint64_t first_line() const { return first_line_; }
  // One line behind the last.
  std::uint64_t end() const { return end_; }

  using Lines = memory::LineRange;
  // Lines that shading reads (frontend::patch_shading_bytes()).
  Lines of_shading(const scene::FrameGeometry& frame, std::uint32_t patch) const;
  // Lines of the data that vertices follow from (frontend::patch_record_bytes()).
  Lines of_geometry(const scene::FrameGeometry& frame, std::uint32_t patch) const;
  // Replaces `out` by the lines that tessellating a sub-patch reads: of its record, of its instance's record, and of
  // the records of patches that own vertices of its boundary. Returns the number of elements that a decoder gives for
  // them (frontend::decoded_elements()).
  std::uint64_t of_tessellation(const scene::FrameGeometry& frame, const tilecore::TessellationRequest& request,
                                std::vector<Lines>& out) const;
  // Adds the lines that evaluating a piece of a procedure reads in the record of the piece's first patch: the header
  // and the piece's numbers, without the numbers of its other stages.
  void of_piece(const scene::FrameGeometry& frame, std::uint32_t patch, std::uint32_t piece,
                std::vector<Lines>& out) const;
  // Adds, for a geometry image, the lines of its points under a part of the domain, row by row.
  void of_image(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::ParameterRange& part,
                std::vector<Lines>& out) const;
  // Cells of procedures (tilecore/procedural/parameter_maps.h) lie behind all other lines: [assumed] in the last
  // quarter of the line numbers.
  static constexpr std::uint32_t kCellsAt = timing::MemoryLayout::kFarLines;
  // First line of the frame histories of resolve units, behind the cells.
  static constexpr std::uint32_t kHistoryAt = 7u << 29;
  Lines of_cell(std::uint32_t cell, std::uint64_t cell_bytes) const;
  // Empty if the patch's drawable has no instances.
  Lines of_instance(std::uint32_t patch) const;
  // The first `bytes` of the records of lights.
  Lines of_lights(std::uint64_t bytes) const;

 private:
  Lines lines(std::uint64_t begin, std::uint64_t end) const;

  const scene::Assembly& assembly_;
  std::uint64_t line_bytes_, first_line_, first_light_line_, end_;
  std::vector<std::uint64_t> offsets_;      // bytes, by record; the last is the end of all
  std::vector<std::uint32_t> instance_of_;  // by drawable: number of its instance record, if it has one
};

}  // namespace tessera::gpu
