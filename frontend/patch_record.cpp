#include "frontend/patch_record.h"

#include <set>

#include "scene/procedure_patch.h"

namespace tessera::frontend {
namespace {

using scene::Primitive;

constexpr std::uint64_t kFrameVectorBytes = 4, kTexcoordBytes = 8, kColorBytes = 4, kPatchCorners = 4;

const scene::Cluster& cluster_of(const scene::Assembly& assembly, const scene::Drawable& drawable,
                                 std::uint32_t patch) {
  return assembly.clusters[drawable.geometry].clusters[patch - drawable.first_patch];
}

const Primitive& primitive_of(const scene::Assembly& assembly, const scene::Drawable& drawable) {
  return assembly.capture->meshes[static_cast<std::size_t>(drawable.mesh)]
      .primitives[static_cast<std::size_t>(drawable.primitive)];
}

// Whether the shader needs the tangents of vertices.
bool reads_tangents(const scene::Material& material) {
  return material.normal_texture.texture != nullptr || material.clearcoat.normal_texture.texture != nullptr ||
         material.has(scene::MaterialEffect::kAnisotropy);
}

// Sets of texture coordinates that the material reads of vertices.
std::uint64_t texcoord_sets(const Primitive& primitive, const scene::Material& material, bool displaced) {
  std::set<int> sets;
  for (const scene::TextureSlot* slot : material.slots())
    if (slot->texture != nullptr) sets.insert(slot->texcoord);
  if (material.has(scene::MaterialEffect::kAnisotropy) && primitive.vertices.tangents.empty())
    sets.insert(scene::tangent_slot(material).texcoord);
  if (displaced) sets.erase(material.displacement->texcoord);
  return sets.size();
}

// Texture coordinates and colours.
std::uint64_t plain_bytes(const Primitive& primitive, const scene::Material& material, bool displaced) {
  return texcoord_sets(primitive, material, displaced) * kTexcoordBytes +
         (primitive.vertices.colors.empty() ? 0 : kColorBytes);
}

}  // namespace

std::uint64_t patch_record_bytes(const scene::Assembly& assembly, std::uint32_t patch, bool deforming) {
  const scene::Drawable& drawable = assembly.drawable_of(patch);
  const std::uint64_t keys = deforming ? 2 : 1;
  const scene::HeldGeometry* held = assembly.held_geometry(drawable);
  const std::uint64_t encoded = held != nullptr ? held->record_bytes[patch - drawable.first_patch] : 0;
  switch (drawable.kind) {
    case Primitive::Kind::kProcedure:
      return kPatchHeaderBytes + procedure_record_bytes(assembly.capture->procedures[drawable.geometry], deforming);
    case Primitive::Kind::kBezierPatches: {
      const bool displaced = assembly.materials[static_cast<std::size_t>(drawable.material)].displacement.has_value();
      return kPatchHeaderBytes + (held != nullptr ? encoded : 16 * sizeof(Vec3) * keys) +
             (displaced ? kPatchCorners * kTexcoordBytes : 0);
    }
    case Primitive::Kind::kTriangles:
      break;
  }
  if (held != nullptr) return kPatchHeaderBytes + encoded;
  const scene::Cluster& cluster = cluster_of(assembly, drawable, patch);
  return kPatchHeaderBytes + cluster.vertex_count * sizeof(Vec3) * keys +
         cluster.cell_count * sizeof(scene::ClusterCell);
}

bool keeps_two_keys(const scene::Assembly& assembly, const scene::Drawable& drawable) {
  if (drawable.kind == Primitive::Kind::kProcedure) return true;
  const scene::Vertices& vertices = primitive_of(assembly, drawable).vertices;
  return !vertices.influences.empty() || !vertices.morph_targets.empty();
}

std::uint64_t patch_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch) {
  return patch_record_bytes(*frame.assembly, patch, frame.drawable_of(patch).deforming);
}

std::uint64_t decoded_elements(const scene::Assembly& assembly, std::uint32_t patch) {
  const scene::Drawable& drawable = assembly.drawable_of(patch);
  const scene::HeldGeometry* held = assembly.held_geometry(drawable);
  return held != nullptr ? held->record_elements[patch - drawable.first_patch] : 0;
}

const scene::ClusterBound* resting_bound(const scene::FrameGeometry& frame, std::uint32_t patch) {
  const scene::Drawable& drawable = frame.assembly->drawable_of(patch);
  if (drawable.kind != Primitive::Kind::kTriangles) return nullptr;
  const std::vector<scene::ClusterBound>& bounds = frame.assembly->cluster_bounds[drawable.geometry];
  return bounds.empty() ? nullptr : &bounds[patch - drawable.first_patch];
}

std::uint64_t bound_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch) {
  const scene::ClusterBound* bound = resting_bound(frame, patch);
  if (bound == nullptr) return patch_record_bytes(frame, patch);
  const bool masked = frame.drawable_of(patch).material->alpha_mode == scene::AlphaMode::kMask;
  return kClusterBoundBytes + (bound->turned() ? kTurnedBoxBytes : 0) + (masked ? kClusterMaskBytes : 0);
}

std::uint64_t vertex_components(const Primitive& primitive, const scene::Material& material) {
  const std::uint64_t lit = material.unlit ? 0 : 6,
                      tangent = !primitive.vertices.tangents.empty() && reads_tangents(material) ? 4 : 0,
                      color = material.alpha_mode == scene::AlphaMode::kOpaque ? 3 : 4;
  return lit + tangent + 2 * texcoord_sets(primitive, material, false) +
         (primitive.vertices.colors.empty() ? 0 : color);
}

std::uint64_t patch_attribute_bytes(const scene::Assembly& assembly, std::uint32_t patch, bool deforming) {
  const scene::Drawable& drawable = assembly.drawable_of(patch);
  if (drawable.kind == Primitive::Kind::kProcedure) return 0;
  const Primitive& primitive = primitive_of(assembly, drawable);
  const scene::Material& material = assembly.materials[static_cast<std::size_t>(drawable.material)];
  if (drawable.kind == Primitive::Kind::kBezierPatches)
    return kPatchCorners * plain_bytes(primitive, material, material.displacement.has_value());
  const std::uint64_t keys = deforming ? 2 : 1;
  const std::uint64_t frame_vectors =
      (primitive.vertices.normals.empty() ? 0 : kFrameVectorBytes) +
      (primitive.vertices.tangents.empty() || !reads_tangents(material) ? 0 : kFrameVectorBytes);
  return cluster_of(assembly, drawable, patch).vertex_count *
         (keys * frame_vectors + plain_bytes(primitive, material, false));
}

std::uint64_t patch_shading_bytes(const scene::FrameGeometry& frame, std::uint32_t patch) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  if (drawable.procedure != nullptr) return kPatchHeaderBytes + procedure_point_bytes(*drawable.procedure);
  return patch_record_bytes(frame, patch) + patch_attribute_bytes(*frame.assembly, patch, drawable.deforming);
}

}  // namespace tessera::frontend
