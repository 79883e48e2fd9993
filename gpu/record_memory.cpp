#include "gpu/record_memory.h"

#include <limits>

#include "base/error.h"
#include "frontend/instance_culling.h"
#include "frontend/patch_record.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::gpu {
namespace {

// Whether positions may differ between motion keys: room is for both.
bool may_deform(const scene::Assembly& assembly, const scene::Drawable& drawable) {
  if (drawable.kind == scene::Primitive::Kind::kProcedure) return false;
  const scene::Vertices& vertices = assembly.capture->meshes[static_cast<std::size_t>(drawable.mesh)]
                                        .primitives[static_cast<std::size_t>(drawable.primitive)]
                                        .vertices;
  return !vertices.influences.empty() || !vertices.morph_targets.empty();
}

}  // namespace

RecordMemory::RecordMemory(const scene::Assembly& assembly, std::int64_t line_bytes, std::uint64_t first_line)
    : assembly_(assembly), line_bytes_(static_cast<std::uint64_t>(line_bytes)), first_line_(first_line) {
  offsets_.reserve(std::size_t{assembly.record_count} + 1);
  offsets_.push_back(0);
  instance_of_.reserve(assembly.drawables.size());
  std::uint32_t instances = 0;
  for (const scene::Drawable& drawable : assembly.drawables) {
    instance_of_.push_back(drawable.instanced ? instances++ : 0);
    if (drawable.first_record + 1 != offsets_.size()) continue;  // an instance whose records are there
    const bool deforming = may_deform(assembly, drawable);
    for (std::uint32_t p = drawable.first_patch; p < drawable.first_patch + drawable.patch_count; ++p)
      offsets_.push_back(offsets_.back() + frontend::patch_record_bytes(assembly, p, deforming) +
                         frontend::patch_attribute_bytes(assembly, p, deforming));
  }
  end_ = first_line_ + (offsets_.back() + instances * frontend::kInstanceRecordBytes + line_bytes_ - 1) / line_bytes_;
  if (end_ >= std::numeric_limits<std::uint32_t>::max())
    throw LimitError("textures and base patches have more cache lines than 32 bits can number");
}

RecordMemory::Lines RecordMemory::lines(std::uint64_t begin, std::uint64_t end) const {
  return {static_cast<std::uint32_t>(first_line_ + begin / line_bytes_),
          static_cast<std::uint32_t>(first_line_ + (end + line_bytes_ - 1) / line_bytes_)};
}

RecordMemory::Lines RecordMemory::of_shading(const scene::FrameGeometry& frame, std::uint32_t patch) const {
  const std::uint64_t begin = offsets_[assembly_.record_of(patch)];
  return lines(begin, begin + frontend::patch_shading_bytes(frame, patch));
}

RecordMemory::Lines RecordMemory::of_geometry(const scene::FrameGeometry& frame, std::uint32_t patch) const {
  const std::uint64_t begin = offsets_[assembly_.record_of(patch)];
  return lines(begin, begin + frontend::patch_record_bytes(frame, patch));
}

void RecordMemory::of_tessellation(const scene::FrameGeometry& frame, const tilecore::TessellationRequest& request,
                                   std::vector<Lines>& out) const {
  out = {of_geometry(frame, request.patch), of_instance(request.patch)};
  std::vector<std::uint32_t> others;
  tilecore::fetched_neighbours(frame, request.patch, request.range, request.displaced, others);
  for (const std::uint32_t other : others) out.push_back(of_geometry(frame, other));
}

RecordMemory::Lines RecordMemory::of_instance(std::uint32_t patch) const {
  if (!assembly_.drawable_of(patch).instanced) return {0, 0};
  const std::uint64_t begin =
      offsets_.back() + instance_of_[assembly_.patch_drawable[patch]] * frontend::kInstanceRecordBytes;
  return lines(begin, begin + frontend::kInstanceRecordBytes);
}

}  // namespace tessera::gpu
