#include "frontend/patch_record.h"

#include "scene/procedure_patch.h"

namespace tessera::frontend {
namespace {

constexpr std::uint64_t kHeaderBytes = 32;  // [assumed] material, pattern, neighbours, state

}  // namespace

std::uint64_t patch_record_bytes(const scene::FrameGeometry& frame, std::uint32_t patch) {
  const scene::PosedDrawable& drawable = frame.drawable_of(patch);
  const std::uint64_t keys = drawable.deforming ? 2 : 1;
  if (drawable.procedure != nullptr) return kHeaderBytes + procedure_record_bytes(*drawable.procedure);
  if (drawable.drawable->kind == scene::Primitive::Kind::kBezierPatches) return kHeaderBytes + 16 * sizeof(Vec3) * keys;
  const scene::Cluster& cluster =
      frame.assembly->clusters[drawable.drawable->geometry].clusters[patch - drawable.drawable->first_patch];
  return kHeaderBytes + cluster.vertex_count * sizeof(Vec3) * keys + cluster.cell_count * sizeof(scene::ClusterCell);
}

}  // namespace tessera::frontend
