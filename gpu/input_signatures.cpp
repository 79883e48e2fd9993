#include "gpu/input_signatures.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <span>

#include <glm/gtc/type_ptr.hpp>

#include "base/crc64.h"
#include "base/parallel.h"
#include "frontend/instance_culling.h"
#include "frontend/patch_record.h"

namespace tessera::gpu {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;
using tilecore::TileJob;

template <class T>
void add_span(Crc64& crc, std::span<const T> vectors) {
  crc.add_value(vectors.size());
  for (const T& v : vectors) crc.add_values(std::span(glm::value_ptr(v), static_cast<std::size_t>(T::length())));
}

template <glm::length_t C, glm::length_t R, class T, glm::qualifier Q>
void add_matrix(Crc64& crc, const glm::mat<C, R, T, Q>& matrix) {
  crc.add_values(std::span(glm::value_ptr(matrix), static_cast<std::size_t>(C * R)));
}

void add_projection(Crc64& crc, const scene::Projection& p) {
  crc.add_value(static_cast<std::uint8_t>(p.orthographic));
  for (const double number : {p.center_x, p.center_y, p.scale, p.near, p.far, p.lens_scale, p.inverse_focus})
    crc.add_value(number);
}

void add_light(Crc64& crc, const shaders::Light& light) {
  crc.add_value(static_cast<std::uint8_t>(light.type));
  for (const Vec3& v : {light.color, light.position, light.direction}) add_span(crc, std::span(&v, 1));
  for (const float number : {light.range, light.cos_inner, light.cos_outer}) crc.add_value(number);
}

// Adds all properties of a material that may differ from frame to frame.
void add_material(Crc64& crc, const scene::Material& material) {
  add_span(crc, std::span(&material.emissive, 1));
  for (const scene::MaterialNumber& number : scene::material_numbers())
    if (!number.effect || material.effects.any())
      crc.add_values(std::span(number.in(material), static_cast<std::size_t>(number.components)));
  for (const scene::TextureSlot* slot : material.slots()) {
    add_matrix(crc, slot->transform.matrix);
    add_span(crc, std::span(&slot->transform.offset, 1));
  }
}

// Adds the numbers of a procedure that animations may move.
void add_numbers(Crc64& crc, const PosedDrawable& drawable) {
  for (const scene::Procedure* procedure : {drawable.procedure, drawable.procedure_close})
    for (const scene::Procedure::Piece& piece : procedure->pieces)
      crc.add_values(std::span<const float>(piece.input.p));
  crc.add_values(std::span<const float>(drawable.procedure->texture_numbers));
  crc.add_values(std::span<const float>(drawable.procedure->texture_constants));
  crc.add_values(std::span<const float>(drawable.procedure->shading_numbers));
}

// A drawable as one frame, or one segment of it, poses it.
void add_pose(Crc64& crc, const FrameGeometry& frame, std::size_t number) {
  const PosedDrawable& drawable = frame.drawables[number];
  for (const bool flag : {drawable.moving, drawable.deforming, drawable.curved, drawable.mirrored, drawable.visible})
    crc.add_value(static_cast<std::uint8_t>(flag));
  for (std::size_t key = 0; key < 2; ++key) {
    add_matrix(crc, drawable.to_raster[key]);
    add_matrix(crc, drawable.to_world[key]);
    add_matrix(crc, drawable.normal_to_world[key]);
    // The memory's own vertices never change.
    const bool own = drawable.own_vertices;
    crc.add_value(static_cast<std::uint8_t>(own));
    if (own) continue;
    add_span(crc, drawable.positions[key]);
    add_span(crc, drawable.normals[key]);
    add_span(crc, drawable.tangents[key]);
  }
  const scene::Drawable& of = *drawable.drawable;
  if (drawable.procedure != nullptr && !frame.procedures.keys.empty()) add_numbers(crc, drawable);
  if (!scene::has_grid(of)) return;
  for (std::uint32_t g = of.first_grid; g < of.first_grid + of.patch_count; ++g) {
    const scene::TessellationPattern& pattern = frame.patterns[g];
    crc.add_value(pattern.nu);
    crc.add_value(pattern.nv);
    crc.add_values(std::span<const std::uint8_t>(pattern.edge));
    crc.add_value(frame.displacement_lod[g]);
  }
}

std::uint64_t drawable_signature(const FrameGeometry& frame, std::size_t number) {
  Crc64 crc;
  add_pose(crc, frame, number);
  add_material(crc, *frame.drawables[number].material);
  for (const auto& segment : frame.segments)
    if (segment->drawables[number].curved) add_pose(crc, *segment, number);
  return crc.value();
}

void add_views(Crc64& crc, const FrameGeometry& frame) {
  add_projection(crc, frame.projection);
  for (std::size_t key = 0; key < 2; ++key) {
    add_projection(crc, frame.projections[key]);
    add_matrix(crc, frame.views[key].world_to_camera);
    crc.add_value(frame.lights[key].size());
    for (const shaders::Light& light : frame.lights[key]) add_light(crc, light);
  }
}

// Whether a frame's tiles depend on state besides the pose.
bool goes_on(const GpuConfiguration& gpu, const TileJob& job) {
  return job.resolve != nullptr || job.procedures != nullptr || gpu.frontend.previous_depth_culling;
}

std::uint64_t constants_signature(const GpuConfiguration& gpu, const TileJob& job) {
  const FrameGeometry& frame = *job.frame;
  Crc64 crc;
  add_views(crc, frame);
  crc.add_value(static_cast<std::uint8_t>(frame.any_motion));
  crc.add_value(static_cast<std::uint8_t>(frame.moving_lights));
  crc.add_value(frame.segments.size());
  for (const auto& segment : frame.segments) {
    crc.add_value(segment->part.first);
    crc.add_value(segment->part.end);
    add_views(crc, *segment);
  }
  if (goes_on(gpu, job)) crc.add_value(job.pattern->frame());
  crc.add_value(job.maps_signature);
  return crc.value();
}

std::uint64_t tile_signature(const TileJob& job, std::uint64_t constants, std::span<const std::uint64_t> drawables,
                             std::span<const binner::ListEntry> entries) {
  const FrameGeometry& frame = *job.frame;
  bool sees_times = frame.projection.lens_scale != 0 || frame.moving_lights || job.forced.motion || job.forced.lens;
  Crc64 crc;
  crc.add_value(constants);
  for (const binner::ListEntry& entry : entries) {
    const std::uint32_t drawable = frame.assembly->patch_drawable[entry.base_patch];
    sees_times = sees_times || frame.drawables[drawable].moving;
    crc.add_value(drawables[drawable]);
    crc.add_value(entry.base_patch);
    const scene::CellRange& r = entry.range;
    const binner::BlockRange& b = entry.blocks;
    crc.add_values(std::span<const std::uint8_t>(std::to_array<std::uint8_t>(
        {r.i0, r.j0, r.i1, r.j1, entry.t0, entry.t1, entry.flags, static_cast<std::uint8_t>(entry.segment & 0xFF),
         static_cast<std::uint8_t>(entry.segment >> 8), static_cast<std::uint8_t>(entry.whole), b.column, b.row,
         b.more_columns, b.more_rows, static_cast<std::uint8_t>(b.wide)})));
    crc.add_value(entry.near_depth);
  }
  if (sees_times) crc.add_value(job.pattern->frame());
  return crc.value();
}

// Number of bytes that the front end and the binner hash.
std::uint64_t hashed_bytes(const FrameGeometry& frame, std::span<const std::uint8_t> in_lists, std::uint64_t entries,
                           const binner::Binner& binner) {
  constexpr std::uint64_t kEntryBytes = 8 + 2;  // a sub-patch's signature and its interval
  std::uint64_t bytes =
      entries * kEntryBytes + binner.grid().tile_count() * sizeof(std::uint64_t) + binner.buffer().table().size();
  const scene::Drawable* last = nullptr;
  for (std::uint32_t patch = 0; patch < in_lists.size(); ++patch) {
    if (in_lists[patch] == 0) continue;
    bytes += frontend::bound_record_bytes(frame, patch);
    // Patches of a drawable are numbered consecutively.
    const scene::Drawable& drawable = frame.assembly->drawable_of(patch);
    if (drawable.instanced && &drawable != last) bytes += frontend::kInstanceRecordBytes;
    last = &drawable;
  }
  return bytes;
}

template <class T>
void copy_tile(IntRect tile, IntRect region, const ImageOf<T>& from, ImageOf<T>& to) {
  if (to.values.empty()) return;
  for (int y = tile.y0; y < tile.y1; ++y) {
    const std::size_t first = to.index(tile.x0 - region.x0, y - region.y0),
                      count = static_cast<std::size_t>(tile.width()) * static_cast<std::size_t>(to.channels);
    std::copy_n(from.values.begin() + static_cast<std::ptrdiff_t>(first), count,
                to.values.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

}  // namespace

void InputSignatures::begin(bool follows) {
  known_ = follows && whole_;
  whole_ = true;
}

std::vector<bool> InputSignatures::unchanged(const GpuConfiguration& gpu, const TileJob& job,
                                             const binner::Binner& binner, EliminationCounters& counters) {
  const FrameGeometry& frame = *job.frame;
  const std::uint64_t constants = constants_signature(gpu, job);
  std::vector<std::uint64_t> drawables(frame.drawables.size());
  parallel_for(drawables.size(), [&](std::size_t d) { drawables[d] = drawable_signature(frame, d); });
  const std::size_t tiles = binner.grid().tile_count();
  std::vector<std::uint64_t> now(tiles), entry_counts(tiles);
  std::vector<std::uint8_t> in_lists(frame.assembly->patch_count());
  parallel_for(tiles, [&](std::size_t tile) {
    memory::Ledger ledger;
    std::uint64_t bytes = 0;
    const std::vector<binner::ListEntry> entries =
        binner.read_tile(frame, static_cast<binner::TileIndex>(tile), ledger, bytes);
    for (const binner::ListEntry& entry : entries)
      std::atomic_ref(in_lists[entry.base_patch]).store(1, std::memory_order_relaxed);
    entry_counts[tile] = entries.size();
    now[tile] = tile_signature(job, constants, drawables, entries);
  });
  counters.signature_bytes += hashed_bytes(
      frame, in_lists, std::accumulate(entry_counts.begin(), entry_counts.end(), std::uint64_t{0}), binner);
  std::vector<bool> same(tiles, false);
  shown_.resize(tiles);
  const int bits = gpu.frame_buffer.signature_bits;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    same[tile] = known_ && tilecore::kept_bits(now[tile], bits) == tilecore::kept_bits(shown_[tile], bits);
    if (same[tile]) {
      ++counters.tiles_eliminated;
      counters.wrong_eliminations += now[tile] != shown_[tile];
    } else {
      shown_[tile] = now[tile];
    }
  }
  return same;
}

std::optional<std::uint64_t> InputSignatures::of_all_tiles() const {
  if (!whole_) return std::nullopt;
  Crc64 crc;
  crc.add_values(std::span<const std::uint64_t>(shown_));
  return crc.value();
}

void InputSignatures::keep_images(IntRect tile, tilecore::FrameTargets& targets) const {
  const IntRect region = targets.region;
  copy_tile(tile, region, images_.color, targets.color);
  copy_tile(tile, region, images_.depth, targets.depth);
  copy_tile(tile, region, images_.normal, targets.normal);
  copy_tile(tile, region, images_.invocations, targets.invocations);
  copy_tile(tile, region, images_.patch, targets.patch);
  copy_tile(tile, region, images_.ids, targets.ids);
}

void InputSignatures::finish(const tilecore::FrameTargets& targets) { images_ = targets; }

}  // namespace tessera::gpu
