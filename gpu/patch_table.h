#pragma once

#include <cstdint>
#include <vector>

#include "memory/line_cache.h"
#include "scene/frame_geometry.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "timing/events/memory_layout.h"

namespace tessera::gpu {

// Where the records of base patches (frontend/patch_record.h) lie for tile cores, in cache lines behind the textures: one
// behind the other, without holes; those of instances are one. Which lines tessellating a patch reads, and which shading
// it: its whole record, and that of its instance.
class PatchTable {
 public:
  // `first_line`: the first free line. Records of lights take `light_bytes` behind the records of patches. Throws LimitError
  // where lines cannot be numbered below kCellsAt.
  PatchTable(const scene::Assembly& assembly, std::int64_t line_bytes, std::uint64_t first_line,
             std::uint64_t light_bytes = 0);

  std::uint64_t first_line() const { return first_line_; }
  // One line behind the last.
  std::uint64_t end() const { return end_; }

  using Lines = memory::LineRange;
  // What shading reads (frontend::patch_shading_bytes()).
  Lines of_shading(const scene::FrameGeometry& frame, std::uint32_t patch) const;
  // What vertices follow from (frontend::patch_record_bytes()).
  Lines of_geometry(const scene::FrameGeometry& frame, std::uint32_t patch) const;
  // Replaces `out` by what tessellating a sub-patch reads: its record, that of its instance, and of the patches that own
  // vertices of its boundary. Returns how many elements a decoder gives of them (frontend::decoded_elements()).
  std::uint64_t of_tessellation(const scene::FrameGeometry& frame, const tilecore::TessellationRequest& request,
                                std::vector<Lines>& out) const;
  // Adds what evaluating a piece of a procedure reads of the record of its first patch: the header and its numbers, those
  // of its other stages apart.
  void of_piece(const scene::FrameGeometry& frame, std::uint32_t patch, std::uint32_t piece,
                std::vector<Lines>& out) const;
  // And, of a geometry image, its points under a part of the domain, row by row.
  void of_image(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::ParameterRange& part,
                std::vector<Lines>& out) const;
  // Cells of procedures (tilecore/procedural/parameter_maps.h) lie behind everything else: [assumed] in the last quarter
  // of the lines.
  static constexpr std::uint32_t kCellsAt = timing::MemoryLayout::kFarLines;
  // And what resolve units keep of a frame behind these.
  static constexpr std::uint32_t kHistoryAt = 7u << 29;
  Lines of_cell(std::uint32_t cell, std::uint64_t cell_bytes) const;
  // Empty where the patch's drawable has no instances.
  Lines of_instance(std::uint32_t patch) const;
  // The first `bytes` of the records of lights.
  Lines of_lights(std::uint64_t bytes) const;

 private:
  Lines lines(std::uint64_t begin, std::uint64_t end) const;

  const scene::Assembly& assembly_;
  std::uint64_t line_bytes_, first_line_, first_light_line_, end_;
  std::vector<std::uint64_t> offsets_;      // bytes, by record, and their end
  std::vector<std::uint32_t> instance_of_;  // by drawable: which instance's record, where it has one
};

}  // namespace tessera::gpu
