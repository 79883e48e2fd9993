#include "gpu/patch_table.h"

#include <algorithm>

#include "base/error.h"
#include "frontend/instance_culling.h"
#include "frontend/patch_record.h"
#include "scene/procedure_patch.h"
#include "tilecore/tessellation/tessellator.h"

namespace tessera::gpu {
namespace {

// Whether positions may differ between motion keys, so that the record has room for both. `animated`: nodes of such
// procedures.
bool may_deform(const scene::Assembly& assembly, const std::vector<int>& animated, const scene::Drawable& drawable) {
  if (drawable.kind == scene::Primitive::Kind::kProcedure)
    return std::binary_search(animated.begin(), animated.end(), drawable.node);
  return frontend::keeps_two_keys(assembly, drawable);
}

}  // namespace

PatchTable::PatchTable(const scene::Assembly& assembly, std::int64_t line_bytes, std::uint64_t first_line,
                       std::uint64_t light_bytes)
    : assembly_(assembly), line_bytes_(static_cast<std::uint64_t>(line_bytes)), first_line_(first_line) {
  offsets_.reserve(std::size_t{assembly.record_count} + 1);
  offsets_.push_back(0);
  instance_of_.reserve(assembly.drawables.size());
  std::uint32_t instances = 0;
  const std::vector<int> animated = scene::animated_procedures(*assembly.capture);
  for (const scene::Drawable& drawable : assembly.drawables) {
    instance_of_.push_back(drawable.instanced ? instances++ : 0);
    if (drawable.first_record + 1 != offsets_.size()) continue;  // an instance whose records exist already
    const bool deforming = may_deform(assembly, animated, drawable);
    for (std::uint32_t p = drawable.first_patch; p < drawable.first_patch + drawable.patch_count; ++p)
      offsets_.push_back(offsets_.back() + frontend::patch_record_bytes(assembly, p, deforming) +
                         frontend::patch_attribute_bytes(assembly, p, deforming));
  }
  const auto lines_of = [&](std::uint64_t bytes) { return (bytes + line_bytes_ - 1) / line_bytes_; };
  first_light_line_ = first_line_ + lines_of(offsets_.back() + instances * frontend::kInstanceRecordBytes);
  end_ = first_light_line_ + lines_of(light_bytes);
  if (end_ >= kCellsAt) throw LimitError("textures and base patches have more cache lines than 3/4 of 2^32");
}

PatchTable::Lines PatchTable::lines(std::uint64_t begin, std::uint64_t end) const {
  return {static_cast<std::uint32_t>(first_line_ + begin / line_bytes_),
          static_cast<std::uint32_t>(first_line_ + (end + line_bytes_ - 1) / line_bytes_)};
}

PatchTable::Lines PatchTable::of_shading(const scene::FrameGeometry& frame, std::uint32_t patch) const {
  const std::uint64_t begin = offsets_[assembly_.record_of(patch)];
  return lines(begin, begin + frontend::patch_shading_bytes(frame, patch));
}

PatchTable::Lines PatchTable::of_geometry(const scene::FrameGeometry& frame, std::uint32_t patch) const {
  const std::uint64_t begin = offsets_[assembly_.record_of(patch)];
  return lines(begin, begin + frontend::patch_record_bytes(frame, patch));
}

std::uint64_t PatchTable::of_tessellation(const scene::FrameGeometry& frame,
                                          const tilecore::TessellationRequest& request, std::vector<Lines>& out) const {
  out = {of_geometry(frame, request.patch), of_instance(request.patch)};
  std::vector<std::uint32_t> others;
  tilecore::fetched_neighbours(frame, request.patch, request.range, request.displaced, others);
  std::uint64_t elements = frontend::decoded_elements(assembly_, request.patch);
  for (const std::uint32_t other : others) {
    out.push_back(of_geometry(frame, other));
    elements += frontend::decoded_elements(assembly_, other);
  }
  return elements;
}

void PatchTable::of_piece(const scene::FrameGeometry& frame, std::uint32_t patch, std::uint32_t piece,
                          std::vector<Lines>& out) const {
  const scene::Procedure& procedure = *frame.drawable_of(patch).procedure;
  // The numbers of both motion keys lie side by side.
  const std::uint64_t begin = offsets_[assembly_.record_of(patch)],
                      numbers = scene::procedure_piece_bytes(procedure) * (frame.drawable_of(patch).deforming ? 2 : 1),
                      first = begin + frontend::kPatchHeaderBytes + piece * numbers;
  out.push_back(lines(begin, begin + frontend::kPatchHeaderBytes));
  Lines of = lines(first, first + numbers);
  of.first = std::max(of.first, out.back().end);  // each line is asked for once
  if (of.first < of.end) out.push_back(of);
}

void PatchTable::of_image(const scene::FrameGeometry& frame, std::uint32_t patch, const scene::ParameterRange& part,
                          std::vector<Lines>& out) const {
  const scene::Procedure& procedure = *frame.drawable_of(patch).procedure;
  if (!procedure.image) return;
  constexpr std::uint64_t kPointBytes = 12;  // three floats
  const shaders::GeometryImage& image = *procedure.image;
  const std::uint64_t begin =
      offsets_[assembly_.record_of(patch)] + frontend::patch_record_bytes(frame, patch) - kPointBytes * image.x.size();
  const auto point = [](float at, int size) {
    return static_cast<std::uint64_t>(std::clamp(static_cast<int>(at * static_cast<float>(size - 1)), 0, size - 1));
  };
  const auto beside = [](std::uint64_t p, int size) { return std::min(p + 1, static_cast<std::uint64_t>(size) - 1); };
  const std::uint64_t first = point(part.u0, image.width), last = beside(point(part.u1, image.width), image.width),
                      last_row = beside(point(part.v1, image.height), image.height);
  for (std::uint64_t row = point(part.v0, image.height); row <= last_row; ++row) {
    const std::uint64_t at = begin + kPointBytes * row * static_cast<std::uint64_t>(image.width);
    out.push_back(lines(at + kPointBytes * first, at + kPointBytes * (last + 1)));
  }
}

PatchTable::Lines PatchTable::of_cell(std::uint32_t cell, std::uint64_t cell_bytes) const {
  const std::uint64_t at = cell * cell_bytes;
  const auto line = [&](std::uint64_t bytes) { return static_cast<std::uint32_t>(kCellsAt + bytes / line_bytes_); };
  return {line(at), line(at + cell_bytes - 1) + 1};
}

PatchTable::Lines PatchTable::of_instance(std::uint32_t patch) const {
  if (!assembly_.drawable_of(patch).instanced) return {0, 0};
  const std::uint64_t begin =
      offsets_.back() + instance_of_[assembly_.patch_drawable[patch]] * frontend::kInstanceRecordBytes;
  return lines(begin, begin + frontend::kInstanceRecordBytes);
}

PatchTable::Lines PatchTable::of_lights(std::uint64_t bytes) const {
  const std::uint64_t begin = (first_light_line_ - first_line_) * line_bytes_;
  return lines(begin, begin + bytes);
}

}  // namespace tessera::gpu
