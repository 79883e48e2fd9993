#include "frontend/front_end.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
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

FrontEndResult run_front_end(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                             const FrontEndSpec& spec, const OcclusionGuess* guess) {
  // Blocks of patches in parallel, joined in order.
  constexpr std::size_t kBlock = 64;
  const std::size_t patch_count = frame.assembly->patch_count(), block_count = (patch_count + kBlock - 1) / kBlock;
  std::vector<FrontEndResult> blocks(block_count);
  parallel_for(block_count, [&](std::size_t b) {
    FrontEndResult& result = blocks[b];
    PatchSplitter splitter(frame, pyramids, spec, guess);
    for (std::size_t p = b * kBlock; p < std::min(patch_count, (b + 1) * kBlock); ++p) {
      const auto patch = static_cast<std::uint32_t>(p);
      const scene::PosedDrawable& drawable = frame.drawable_of(patch);
      const bool skip_procedures = frame.request.sample_procedures || !frame.request.procedures;
      if (!drawable.visible || (skip_procedures && drawable.procedure != nullptr)) continue;
      result.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData,
                         memory::burst_bytes(0, patch_record_bytes(frame, patch), spec.burst_bytes));
      splitter.split(patch, result.sub_patches, result.deferred, result.counters);
    }
  });
  FrontEndResult all;
  for (const FrontEndResult& block : blocks) {
    all.sub_patches.insert(all.sub_patches.end(), block.sub_patches.begin(), block.sub_patches.end());
    all.deferred.insert(all.deferred.end(), block.deferred.begin(), block.deferred.end());
    merge(all.counters, block.counters);
    all.ledger += block.ledger;
  }
  return all;
}

std::vector<BoundedSubPatch> second_pass_visible(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                                                 const FrontEndSpec& spec, const CoarseDepth& depth,
                                                 FrontEndResult& front_end) {
  std::vector<BoundedSubPatch> visible;
  PatchSplitter splitter(frame, pyramids, spec);
  for (const BoundedSubPatch& piece : front_end.deferred) {
    if (OcclusionGuess::hidden_by(depth, piece.bounds)) continue;
    front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData,
                          memory::burst_bytes(0, patch_record_bytes(frame, piece.base_patch), spec.burst_bytes));
    splitter.split_deferred(piece, visible, front_end.counters);
  }
  return visible;
}

}  // namespace tessera::frontend
