#include "frontend/front_end.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"

namespace tessera::frontend {
namespace {

constexpr std::size_t kBlocksAtOnce = 512;

// Sub-patches of a frame, of which there may be millions: a vector that grew by doubling would need three times its room.
class SubPatchStore {
 public:
  void add(const std::vector<BoundedSubPatch>& pieces) {
    if (chunks_.empty() || chunks_.back().size() + pieces.size() > kChunk) {
      chunks_.emplace_back();
      if (chunks_.size() > 1) chunks_.back().reserve(std::max(kChunk, pieces.size()));
    }
    chunks_.back().insert(chunks_.back().end(), pieces.begin(), pieces.end());
    size_ += pieces.size();
  }
  std::size_t size() const { return size_; }

  // All of them, in order; each chunk is freed when it is copied.
  std::vector<BoundedSubPatch> take() {
    if (chunks_.size() == 1) return std::move(chunks_[0]);
    std::vector<BoundedSubPatch> all;
    all.reserve(size_);
    for (std::vector<BoundedSubPatch>& chunk : chunks_) {
      all.insert(all.end(), chunk.begin(), chunk.end());
      std::vector<BoundedSubPatch>().swap(chunk);
    }
    return all;
  }

 private:
  // So many that the allocator gives a chunk's pages back to the system.
  static constexpr std::size_t kChunk = (std::size_t{40} << 20) / sizeof(BoundedSubPatch);
  std::vector<std::vector<BoundedSubPatch>> chunks_;
  std::size_t size_ = 0;
};

// Drawables whose patches this frame draws. `read`: by drawable, empty for all.
std::vector<std::uint32_t> drawables_to_read(const scene::FrameGeometry& frame, const std::vector<std::uint8_t>& read) {
  const bool skip_procedures = frame.request.sample_procedures || !frame.request.procedures;
  std::vector<std::uint32_t> drawables;
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    const scene::Drawable& drawable = *frame.drawables[d].drawable;
    if (drawable.patch_count == 0 || (!read.empty() && read[d] == 0)) continue;
    if (!frame.moves_here(frame.drawables[d])) continue;
    if (!frame.drawables[d].visible || (skip_procedures && frame.drawables[d].procedure != nullptr)) continue;
    drawables.push_back(static_cast<std::uint32_t>(d));
  }
  return drawables;
}

std::vector<PatchRun> cut(const std::vector<PatchRun>& runs) {
  std::vector<PatchRun> blocks;
  for (const PatchRun& run : runs)
    for (std::uint32_t p = run.first; p < run.end; p = blocks.back().end)
      blocks.push_back({p, p + std::min(kPatchesPerBlock, run.end - p)});
  return blocks;
}

TableFetches make_fetches(const FrontEndSpec& spec) {
  return TableFetches({kTableCacheBytes, kTableCacheWays, static_cast<std::int64_t>(spec.burst_bytes), kCachedRecords});
}

// The L2 as the front end has it: empty at first, and to itself, for tiles begin when all is binned. What blocks of
// patches miss in their own caches goes through it in order.
class TableL2 {
 public:
  explicit TableL2(const FrontEndSpec& spec)
      : burst_bytes_(spec.burst_bytes), cache_(spec.l2_bytes, spec.l2_ways, static_cast<std::int64_t>(burst_bytes_)) {}

  void read(std::span<const std::uint32_t> lines, FrontEndResult& front_end) {
    std::uint64_t missed = 0;
    for (const std::uint32_t line : lines) missed += cache_.use(line) ? 0 : 1;
    front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kTexture, missed * burst_bytes_);
    front_end.counters.table_lines += lines.size();
  }

 private:
  std::uint64_t burst_bytes_;
  memory::LineCache cache_;
};

void charge_records(TableFetches& fetches, memory::Ledger& ledger) {
  (void)fetches.take_table_bytes();
  ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData, fetches.take_record_bytes());
}

}  // namespace

// What moves by one frame's poses: by those of the whole shutter or of a segment.
FrontEndResult run_part(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids, const FrontEndSpec& spec,
                        const OcclusionGuess* guess, TableL2& l2, scene::MemoryBudget* budget) {
  InstanceCulling culling = cull_instances(frame, pyramids, spec);
  FrontEndResult all;
  all.instances = culling.counters;
  all.ledger = culling.ledger;
  PatchCulling patches = cull_patches(frame, drawables_to_read(frame, culling.read), pyramids, spec);
  all.groups = patches.counters;
  all.ledger += patches.ledger;
  all.read = std::move(patches.read);
  struct Counts {
    FrontendCounters counters;
    memory::Ledger ledger;
  };
  const std::vector<PatchRun> blocks = cut(all.read);
  PerThread<Counts> counts;
  // Blocks of patches in parallel, joined in order; not all at once, so that what is too much is noticed early.
  struct Pieces {
    std::vector<BoundedSubPatch> sub_patches, deferred;
    std::vector<std::uint32_t> table_lines;
  };
  SubPatchStore sub_patches, deferred;
  for (std::size_t first = 0; first < blocks.size(); first += kBlocksAtOnce) {
    std::vector<Pieces> pieces(std::min(kBlocksAtOnce, blocks.size() - first));
    parallel_for(pieces.size(), [&](std::size_t b) {
      Counts& own = counts.local();
      TableFetches fetches = make_fetches(spec);
      PatchSplitter splitter(frame, pyramids, spec, guess, &fetches);
      for (std::uint32_t patch = blocks[first + b].first; patch < blocks[first + b].end; ++patch) {
        own.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData,
                        memory::burst_bytes(0, bound_record_bytes(frame, patch), spec.burst_bytes));
        fetches.pass_record(frame.assembly->record_of(patch));
        splitter.split(patch, pieces[b].sub_patches, pieces[b].deferred, own.counters);
        charge_records(fetches, own.ledger);
      }
      pieces[b].table_lines = fetches.take_missed_lines();
    });
    const std::size_t before = sub_patches.size() + deferred.size();
    for (const Pieces& of_block : pieces) {
      sub_patches.add(of_block.sub_patches);
      deferred.add(of_block.deferred);
      l2.read(of_block.table_lines, all);
    }
    if (budget != nullptr)
      budget->charge(sub_patches.size() + deferred.size() - before, sizeof(BoundedSubPatch), "a block of sub-patches");
  }
  all.sub_patches = sub_patches.take();
  all.deferred = deferred.take();
  counts.for_each([&](Counts& own) {
    merge(all.counters, own.counters);
    all.ledger += own.ledger;
  });
  return all;
}

FrontEndResult run_front_end(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                             const FrontEndSpec& spec, const OcclusionGuess* guess, scene::MemoryBudget* budget) {
  TableL2 l2(spec);
  FrontEndResult all = run_part(frame, pyramids, spec, guess, l2, budget);
  const auto append = [](auto& to, auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (std::size_t s = 0; s < frame.segments.size(); ++s) {
    FrontEndResult part = run_part(*frame.segments[s], pyramids, spec, guess, l2, budget);
    for (auto* pieces : {&part.sub_patches, &part.deferred})
      for (BoundedSubPatch& piece : *pieces) piece.segment = static_cast<std::uint8_t>(s + 1);
    append(all.sub_patches, part.sub_patches);
    append(all.deferred, part.deferred);
    append(all.read, part.read);
    merge(all.counters, part.counters);
    merge(all.instances, part.instances);
    merge(all.groups, part.groups);
    all.ledger += part.ledger;
  }
  return all;
}

std::vector<BoundedSubPatch> second_pass_visible(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                                                 const FrontEndSpec& spec, const CoarseDepth& depth,
                                                 FrontEndResult& front_end) {
  std::vector<BoundedSubPatch> visible;
  TableFetches fetches = make_fetches(spec);
  TableL2 l2(spec);
  std::vector<PatchSplitter> splitters;
  for (std::size_t s = 0; s <= frame.segments.size(); ++s)
    splitters.emplace_back(frame.segment(static_cast<int>(s)), pyramids, spec, nullptr, &fetches);
  for (const BoundedSubPatch& piece : front_end.deferred) {
    if (OcclusionGuess::hidden_by(depth, piece.bounds)) continue;
    const scene::FrameGeometry& posed = frame.segment(piece.segment);
    front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData,
                          memory::burst_bytes(0, bound_record_bytes(posed, piece.base_patch), spec.burst_bytes) +
                              instance_record_bytes(posed.drawable_of(piece.base_patch)));
    const std::size_t before = visible.size();
    splitters[piece.segment].split_deferred(piece, visible, front_end.counters);
    charge_records(fetches, front_end.ledger);
    l2.read(fetches.take_missed_lines(), front_end);
    for (std::size_t k = before; k < visible.size(); ++k) visible[k].segment = piece.segment;
  }
  return visible;
}

}  // namespace tessera::frontend
