#include "tilecore/shading/vertex_outputs.h"

#include <algorithm>
#include <bit>

#include "scene/material.h"
#include "scene/procedure_patch.h"
#include "tilecore/procedural/procedure_costs.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/scalar_lanes.h"
#include "tilecore/shading/shader_features.h"
#include "tilecore/shading/vertex_kernel.h"

namespace tessera::tilecore {
namespace {

using scene::TextureSlot;

constexpr std::uint64_t kPlaceBytes = 12, kRasterBytes = 16, kNormalBytes = 12, kTangentBytes = 16,
                        kCoordinateBytes = 8, kColorBytes = 16;

// Textures of a material that its shader reads.
template <class Use>
void each_texture(const scene::Material& material, const Use& use) {
  const auto slots = material.slots();
  for (std::size_t slot = 0; slot < slots.size(); ++slot) {
    const auto which = static_cast<scene::MaterialTexture>(slot);
    if (slots[slot]->texture != nullptr && scene::is_read(material, which)) use(which, *slots[slot]);
  }
}

// The texture whose coordinate tangents run along: all that need tangents have that one; null: none does, or they have
// several.
const TextureSlot* slot_of_tangents(const scene::Material& material) {
  using Which = scene::MaterialTexture;
  const TextureSlot* slot = nullptr;
  bool several = false;
  const auto need = [&](const TextureSlot& other) {
    several = several || (slot != nullptr &&
                          (slot->texcoord != other.texcoord || slot->transform.matrix != other.transform.matrix));
    slot = &other;
  };
  each_texture(material, [&](Which which, const TextureSlot& read) {
    if (which == Which::kNormal || which == Which::kClearcoatNormal) need(read);
  });
  if (material.has(scene::MaterialEffect::kAnisotropy)) need(scene::tangent_slot(material));
  return several ? nullptr : slot;
}

// Each set of coordinates has a bit; sets from 63 on share one.
std::uint64_t bit_of_set(int texcoord) { return std::uint64_t{1} << std::min(texcoord, 63); }

// The sets of coordinates that the drawable's shader reads.
std::uint64_t coordinate_sets(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  const scene::Material& material = *drawable.material;
  std::uint64_t sets = 0;
  if (adds_height_normals(frame, drawable)) sets |= bit_of_set(material.displacement->texcoord);
  const auto add = [&](const TextureSlot& slot) { sets |= bit_of_set(slot.texcoord); };
  each_texture(material, [&](scene::MaterialTexture, const TextureSlot& slot) { add(slot); });
  // Without tangents pixels derive them, possibly from a coordinate at which no texture is read.
  if (material.has(scene::MaterialEffect::kAnisotropy) && !has_vertex_tangents(material))
    add(scene::tangent_slot(material));
  return sets;
}

constexpr std::int32_t kProcedureRegisters = 32;  // [assumed]

hardware::ShaderCost computed_cost(std::uint32_t clocks) {
  hardware::ShaderCost cost;
  cost.vector_operations = static_cast<std::int32_t>(clocks);
  cost.registers = kProcedureRegisters;
  return cost;
}

}  // namespace

bool interpolates_surface(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  return frame.request.interpolated_surfaces && has_grid(drawable) &&
         (drawable.procedure == nullptr || !frame.request.sample_procedures);
}

bool adds_height_normals(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  return frame.request.height_normals && interpolates_surface(frame, drawable) && drawable.procedure == nullptr &&
         drawable.material->displacement && !drawable.material->unlit;
}

bool has_vertex_tangents(const scene::Material& material) { return slot_of_tangents(material) != nullptr; }

hardware::ShaderCost place_cost(const scene::PosedDrawable& drawable) {
  if (drawable.procedure != nullptr) return computed_cost(place_clocks(drawable));
  return hardware::shader_cost(domain_features(drawable));
}

hardware::ShaderCost output_cost(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  using Features = hardware::ShaderFeatures;
  if (drawable.procedure != nullptr) return computed_cost(geometry_clocks(drawable));
  Features f = domain_features(drawable);
  f.stage = Features::Stage::kOutputs;
  f.height_normals = adds_height_normals(frame, drawable);
  f.coordinates = static_cast<std::uint8_t>(std::popcount(coordinate_sets(frame, drawable)));
  f.vertex_colors = !drawable.primitive->vertices.colors.empty();
  if (has_vertex_tangents(*drawable.material)) f.normals = Features::Normals::kMappedAlongTangents;
  return hardware::shader_cost(f);
}

std::uint64_t vertex_output_bytes(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  const std::uint64_t keys = drawable.moving ? 2 : 1;
  std::uint64_t attributes = keys * kNormalBytes;
  if (drawable.procedure != nullptr) {
    attributes += kPlaceBytes + kNormalBytes;
  } else {
    attributes += kCoordinateBytes * static_cast<std::uint64_t>(std::popcount(coordinate_sets(frame, drawable)));
    if (!drawable.primitive->vertices.colors.empty()) attributes += kColorBytes;
    if (has_vertex_tangents(*drawable.material)) attributes += keys * kTangentBytes;
  }
  return keys * (kPlaceBytes + kRasterBytes) + (frame.request.half_attributes ? attributes / 2 : attributes);
}

void VertexOutputs::begin(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, Use use) {
  frame_ = &frame;
  source_ = drawable.drawable;
  vertices_.clear();
  asked_point_.clear();
  for (std::vector<float>* values : {&asked_u_, &asked_v_, &asked_lod_}) values->clear();
  for (std::size_t key = 0; key < 2; ++key) positions_[key].clear(), normals_[key].clear(), tangents_[key].clear();
  mesh_ = drawable;
  if (drawable.procedure != nullptr) return;
  patches_ = draw_constants(frame, drawable);
  patches_.half_attributes = false;
  height_normals_ = use == Use::kPixels && adds_height_normals(frame, drawable);
  sets_ = use == Use::kPixels ? coordinate_sets(frame, drawable)
                              : bit_of_set(drawable.material->base_color_texture.texcoord);
  tangent_slot_ = use == Use::kPixels ? slot_of_tangents(*drawable.material) : nullptr;
  const auto& from = drawable.primitive->vertices;
  mesh_primitive_.vertices.texcoords.resize(from.texcoords.size());
  for (auto& set : mesh_primitive_.vertices.texcoords) set.clear();
  mesh_primitive_.vertices.colors.clear();
  mesh_drawable_ = *drawable.drawable;
  mesh_drawable_.kind = scene::Primitive::Kind::kTriangles;
}

std::array<std::int32_t, 3> VertexOutputs::triangle(std::uint32_t patch, std::uint32_t number) {
  const bool computed = mesh_.procedure != nullptr;
  const scene::TessellationPattern& pattern = frame_->patterns[source_->first_grid + patch - source_->first_patch];
  return vertices_.triangle(pattern, patch, number, [&](float u, float v) {
    if (computed)
      evaluate_procedure(patch, u, v);
    else
      ask_for(patch, u, v);
  });
}

void VertexOutputs::evaluate_procedure(std::uint32_t patch, float u, float v) {
  const scene::ProcedurePatch at = scene::procedure_patch(*frame_, patch);
  for (std::size_t key = 0; key < (mesh_.deforming ? 2u : 1u); ++key) {
    const ObjectPoint point = object_point(at, key, at.u(u), at.v(v));
    positions_[key].push_back(point.position);
    normals_[key].push_back(point.normal);
  }
}

void VertexOutputs::ask_for(std::uint32_t patch, float u, float v) {
  const scene::PosedDrawable& drawable = *patches_.drawable;
  const std::uint32_t number = patch - drawable.drawable->first_patch;
  asked_point_.push_back(static_cast<std::int32_t>(16 * number));
  asked_u_.push_back(u), asked_v_.push_back(v);
  asked_lod_.push_back(
      drawable.material->displacement ? frame_->displacement_lod[drawable.drawable->first_grid + number] : 0.0f);
}

void VertexOutputs::evaluate_asked() {
  const std::size_t count = asked_point_.size();
  if (count == 0) return;
  // Lanes up to the next multiple of the widest vector.
  const std::size_t lanes = (count + 15) / 16 * 16;
  asked_point_.resize(lanes, asked_point_.back());
  for (std::vector<float>* values : {&asked_u_, &asked_v_, &asked_lod_}) values->resize(lanes, values->back());
  for (std::size_t first = 0; first < count; first += kBatch)
    evaluate_batch(first, std::min<std::size_t>(count - first, kBatch));
  asked_point_.clear();
  for (std::vector<float>* values : {&asked_u_, &asked_v_, &asked_lod_}) values->clear();
}

void VertexOutputs::evaluate_batch(std::size_t first, std::size_t count) {
  const scene::PosedDrawable& drawable = *patches_.drawable;
  const VertexArrays in{&asked_point_[first], &asked_u_[first], &asked_v_[first], &asked_lod_[first]};
  auto& vertices = mesh_primitive_.vertices;
  const auto made = [&](std::size_t column) { return made_[column].data(); };
  for (std::size_t set = 0; set < vertices.texcoords.size(); ++set) {
    if ((sets_ >> std::min<std::size_t>(set, 63) & 1) == 0 || drawable.primitive->vertices.texcoords[set].empty())
      continue;
    vertex_texcoords(patches_, in, count, static_cast<int>(set), {made(0), made(1)});
    for (std::size_t i = 0; i < count; ++i) vertices.texcoords[set].emplace_back(made_[0][i], made_[1][i]);
  }
  if (!drawable.primitive->vertices.colors.empty()) {
    vertex_colors(patches_, in, count, {made(0), made(1), made(2), made(3)});
    for (std::size_t i = 0; i < count; ++i)
      vertices.colors.emplace_back(made_[0][i], made_[1][i], made_[2][i], made_[3][i]);
  }
  const VertexPlaces out{{made(0), made(1), made(2)},
                         {made(3), made(4), made(5)},
                         {made(6), made(7), made(8)},
                         {made(9), made(10), made(11), made(12)}};
  for (std::size_t key = 0; key < (drawable.deforming ? 2u : 1u); ++key) {
    place_vertices(patches_, in, count, key, height_normals_, tangent_slot_, out);
    for (std::size_t i = 0; i < count; ++i) {
      positions_[key].emplace_back(made_[0][i], made_[1][i], made_[2][i]);
      normals_[key].emplace_back(made_[3][i], made_[4][i], made_[5][i]);
      if (drawable.moving && !drawable.deforming) normals_[1].emplace_back(made_[6][i], made_[7][i], made_[8][i]);
      if (tangent_slot_ != nullptr) tangents_[key].emplace_back(made_[9][i], made_[10][i], made_[11][i], made_[12][i]);
    }
  }
}

void VertexOutputs::set_mesh(DrawConstants& draw) {
  evaluate_asked();
  for (std::size_t key = 0; key < 2; ++key) {
    const std::size_t from = mesh_.deforming ? key : 0;
    mesh_.positions[key] = positions_[from], mesh_.tangents[key] = tangents_[from];
    mesh_.normals[key] = normals_[mesh_.moving ? key : 0];
  }
  mesh_.primitive = &mesh_primitive_;
  mesh_.drawable = &mesh_drawable_;
  draw.drawable = &mesh_;
  draw.grid = false;
  draw.height_normals = height_normals_;
  if (!height_normals_) return;
  for (std::size_t key = 0; key < 2; ++key) {
    const Mat3 to_world(mesh_.to_world[key]);
    draw.height_metric[key] = to_world * glm::transpose(to_world);
  }
}

}  // namespace tessera::tilecore
