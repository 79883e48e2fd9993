#include "frontend/front_end.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"

namespace tessera::frontend {
namespace {

constexpr std::size_t kBlocksAtOnce = 512;

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

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
std::vector<std::uint32_t> drawables_to_read(const scene::FrameGeometry& frame, const FrontEndSpec& spec,
                                             const std::vector<std::uint8_t>& read) {
  const bool skip_procedures = frame.request.sample_procedures || !frame.request.procedures;
  std::vector<std::uint32_t> drawables;
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    const scene::Drawable& drawable = *frame.drawables[d].drawable;
    if (drawable.patch_count == 0 || (!read.empty() && read[d] == 0)) continue;
    if (!frame.moves_here(frame.drawables[d])) continue;
    if (!spec.left_out.empty() && spec.left_out[d] != 0) continue;
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

HeightTableCache make_fetches(const FrontEndSpec& spec) {
  return HeightTableCache(
      {kTableCacheBytes, kTableCacheWays, static_cast<std::int64_t>(spec.burst_bytes), kCachedRecords});
}

// The L2 during the front end: empty at first and used by nothing else, as tiles begin when binning ends. Records, and
// the lines that blocks of patches miss in their own caches, go through it in order.
class FrontEndL2 {
 public:
  FrontEndL2(const scene::FrameGeometry& frame, const FrontEndSpec& spec)
      : burst_bytes_(spec.burst_bytes),
        records_(frame, burst_bytes_),
        cache_(spec.l2_bytes, spec.l2_ways, static_cast<std::int64_t>(burst_bytes_)) {}

  void read_records(std::span<const RecordRead> reads, FrontEndResult& front_end) {
    const std::size_t before = front_end.record_misses.size();
    for (const RecordRead& read : reads) {
      const std::uint32_t first = records_.first(read.record);
      const auto lines = static_cast<std::uint32_t>((read.bytes + burst_bytes_ - 1) / burst_bytes_);
      front_end.counters.record_lines += lines;
      for (std::uint32_t line = first; line < first + lines; ++line)
        if (!cache_.use(kRecordsAt | line)) front_end.record_misses.push_back(line);
    }
    const std::uint64_t missed = front_end.record_misses.size() - before;
    front_end.counters.record_misses += missed;
    front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData, missed * burst_bytes_);
    front_end.records_end = records_.end();
  }

  void read_tables(std::span<const std::uint32_t> lines, FrontEndResult& front_end) {
    std::uint64_t missed = 0;
    for (const std::uint32_t line : lines) missed += cache_.use(line) ? 0 : 1;
    front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kTexture, missed * burst_bytes_);
    front_end.counters.table_lines += lines.size();
    front_end.table_lines.insert(front_end.table_lines.end(), lines.begin(), lines.end());
  }

 private:
  static constexpr std::uint32_t kRecordsAt = 1u << 31;  // tables lie before

  std::uint64_t burst_bytes_;
  RecordLines records_;
  memory::LineCache cache_;
};

// Splits base patches, without the sub-patches that `depth`, unless null, hides. Charges and counts into `all`.
std::vector<BoundedSubPatch> split_runs(const scene::FrameGeometry& frame, const std::vector<PatchRun>& runs,
                                        const PyramidLibrary& pyramids, const FrontEndSpec& spec,
                                        const CoarseDepth* depth, FrontEndL2& l2, scene::MemoryBudget* budget,
                                        FrontEndResult& all) {
  struct Counts {
    FrontendCounters counters;
    std::uint64_t blocks_tested = 0;
  };
  const std::vector<PatchRun> blocks = cut(runs);
  PerThread<Counts> counts;
  // Blocks of patches run in parallel and are joined in order; not all at once, so that an excess of sub-patches is
  // noticed early.
  struct Pieces {
    std::vector<BoundedSubPatch> sub_patches;
    std::vector<std::uint32_t> table_lines;
    std::vector<RecordRead> records;
  };
  SubPatchStore sub_patches;
  for (std::size_t first = 0; first < blocks.size(); first += kBlocksAtOnce) {
    std::vector<Pieces> pieces(std::min(kBlocksAtOnce, blocks.size() - first));
    parallel_for(pieces.size(), [&](std::size_t b) {
      Counts& own = counts.local();
      HeightTableCache fetches = make_fetches(spec);
      PatchSplitter splitter(frame, pyramids, spec, depth, &fetches);
      for (std::uint32_t patch = blocks[first + b].first; patch < blocks[first + b].end; ++patch) {
        const std::uint32_t record = frame.assembly->record_of(patch);
        pieces[b].records.push_back({record, bound_record_bytes(frame, patch)});
        fetches.pass_record(record);
        splitter.split(patch, pieces[b].sub_patches, own.counters);
        append(pieces[b].records, fetches.take_missed_records());
        own.counters.elements_decoded +=
            fetches.take_elements() +
            (resting_bound(frame, patch) == nullptr ? decoded_elements(*frame.assembly, patch) : 0);
      }
      own.blocks_tested += splitter.take_blocks_tested();
      pieces[b].table_lines = fetches.take_missed_lines();
    });
    const std::size_t before = sub_patches.size();
    for (const Pieces& of_block : pieces) {
      sub_patches.add(of_block.sub_patches);
      l2.read_records(of_block.records, all);
      l2.read_tables(of_block.table_lines, all);
    }
    if (budget != nullptr)
      budget->charge(sub_patches.size() - before, sizeof(BoundedSubPatch), "a block of sub-patches");
  }
  counts.for_each([&](Counts& own) {
    merge(all.counters, own.counters);
    all.previous_depth.blocks_tested += own.blocks_tested;
  });
  return sub_patches.take();
}

void count(const PatchCulling& culling, FrontEndResult& all) {
  merge(all.groups, culling.counters);
  merge(all.previous_depth, culling.previous_depth);
  all.ledger += culling.ledger;
}

// The sub-patches and deferred candidates of drawables that move by one frame's poses, the whole shutter's or a
// segment's.
struct Part {
  std::vector<BoundedSubPatch> sub_patches;
  std::vector<OcclusionCandidate> deferred;
};
Part run_part(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids, const FrontEndSpec& spec,
              const CoarseDepth* guess, FrontEndL2& l2, scene::MemoryBudget* budget, FrontEndResult& all) {
  const InstanceCulling instances = cull_instances(frame, pyramids, spec, guess);
  merge(all.instances, instances.counters);
  merge(all.previous_depth, instances.previous_depth);
  all.ledger += instances.ledger;
  const PatchCulling patches =
      cull_patches(frame, drawables_to_read(frame, spec, instances.read), pyramids, spec, guess);
  count(patches, all);
  Part part{split_runs(frame, patches.read, pyramids, spec, nullptr, l2, budget, all), instances.deferred};
  append(part.deferred, patches.deferred);
  return part;
}

// The patches of deferred candidates that `depth` does not hide, without the groups among them that it hides. Each
// instance's record is read again.
std::vector<PatchRun> patches_again(const scene::FrameGeometry& frame, const std::vector<OcclusionCandidate>& visible,
                                    const PyramidLibrary& pyramids, const FrontEndSpec& spec, const CoarseDepth& depth,
                                    FrontEndResult& all) {
  std::vector<std::uint8_t> read(frame.drawables.size(), 0);
  std::vector<PatchRun> runs;
  all.counters.second_pass_visible += visible.size();
  for (const OcclusionCandidate& d : visible) {
    if (d.kind == OcclusionCandidate::kGroup) {
      --all.previous_depth.groups_culled;
      all.previous_depth.patches_culled -= group_patches(frame, d);
      const PatchCulling left = cull_group(frame, d, pyramids, spec, depth);
      count(left, all);
      append(runs, left.read);
      continue;
    }
    const std::uint32_t end = d.number + instance_drawables(*frame.assembly, d.number);
    --all.previous_depth.groups_culled;
    all.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData,
                    memory::burst_bytes(0, kInstanceRecordBytes, spec.burst_bytes));
    for (std::uint32_t k = d.number; k < end; ++k) {
      read[k] = 1;
      all.previous_depth.patches_culled -= frame.drawables[k].drawable->patch_count;
    }
  }
  const PatchCulling left = cull_patches(frame, drawables_to_read(frame, spec, read), pyramids, spec, &depth);
  count(left, all);
  append(runs, left.read);
  return runs;
}

}  // namespace

FrontEndResult run_front_end(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                             const FrontEndSpec& spec, const CoarseDepth* guess, scene::MemoryBudget* budget) {
  FrontEndL2 l2(frame, spec);
  FrontEndResult all;
  if (guess != nullptr) all.previous_depth.blocks_reprojected = guess->farthest.size();
  for (int s = 0; s <= static_cast<int>(frame.segments.size()); ++s) {
    Part part = run_part(frame.segment(s), pyramids, spec, guess, l2, budget, all);
    for (BoundedSubPatch& piece : part.sub_patches) piece.segment = static_cast<std::uint16_t>(s);
    for (OcclusionCandidate& deferred : part.deferred) {
      deferred.segment = static_cast<std::uint16_t>(s);
      pack_candidates(deferred, all.deferred);
    }
    if (s == 0)
      all.sub_patches = std::move(part.sub_patches);
    else
      append(all.sub_patches, part.sub_patches);
  }
  all.previous_depth.deferred_bytes = all.deferred.size();
  all.ledger.write(memory::Unit::kFrontend, memory::Purpose::kCoarseDepth,
                   memory::burst_bytes(0, all.deferred.size(), spec.burst_bytes));
  return all;
}

std::vector<BoundedSubPatch> second_pass_visible(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                                                 const FrontEndSpec& spec, const CoarseDepth& depth,
                                                 FrontEndResult& front_end) {
  front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kCoarseDepth,
                        memory::burst_bytes(0, front_end.deferred.size(), spec.burst_bytes));
  std::vector<std::vector<OcclusionCandidate>> visible(frame.segments.size() + 1);
  for (const OcclusionCandidate& d : unpack_candidates(front_end.deferred))
    if (!depth.hides(d.footprint, front_end.previous_depth.blocks_tested)) visible[d.segment].push_back(d);
  std::vector<BoundedSubPatch> all;
  FrontEndL2 l2(frame, spec);
  for (std::size_t s = 0; s < visible.size(); ++s) {
    if (visible[s].empty()) continue;
    const scene::FrameGeometry& posed = frame.segment(static_cast<int>(s));
    std::vector<BoundedSubPatch> part =
        split_runs(posed, patches_again(posed, visible[s], pyramids, spec, depth, front_end), pyramids, spec, &depth,
                   l2, nullptr, front_end);
    for (BoundedSubPatch& piece : part) piece.segment = static_cast<std::uint16_t>(s);
    append(all, part);
  }
  return all;
}

}  // namespace tessera::frontend
