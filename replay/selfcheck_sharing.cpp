#include "replay/selfcheck_sharing.h"

#include <algorithm>
#include <vector>

#include "timing/timing_model.h"

namespace tessera::replay {
namespace {

// The cores that asked for each line, a bit each; the 64th stands for all further ones.
class AskedLines {
 public:
  void ask(std::uint32_t line, std::uint32_t core) {
    if (line >= cores_.size()) cores_.resize(line + std::size_t{1}, 0);
    cores_[line] |= std::uint64_t{1} << std::min(core, 63u);
  }
  SharedLines count() const {
    SharedLines out;
    for (const std::uint64_t cores : cores_) {
      out.lines += cores != 0 ? 1 : 0;
      out.shared += (cores & (cores - 1)) != 0 ? 1 : 0;
    }
    return out;
  }

 private:
  std::vector<std::uint64_t> cores_;  // by line
};

}  // namespace

SharedLines shared_lines(const hardware::Machine& gpu, const timing::FrameWork& work, WarpOwner owner) {
  const timing::Schedule schedule = timing::schedule_frame(gpu, work);
  const auto cores = static_cast<std::uint32_t>(gpu.cores.count);
  AskedLines asked;
  std::uint32_t turn = 0;
  for (const timing::TileSchedule& tile : schedule.tiles) {
    const timing::WorkRound& round = work.rounds[tile.round];
    if (round.items.empty()) continue;
    const timing::TileItems& items = round.items[tile.index];
    // Lines of alpha tests come first, and belong to the tile's core either way.
    std::size_t next = 0;
    for (const timing::SubPatchItem& item : items.sub_patches)
      for (std::uint32_t k = 0; k < item.texel_lines; ++k) asked.ask(items.texel_lines[next++], tile.core);
    for (const timing::WarpItem& warp : items.warps) {
      const std::uint32_t core = owner == WarpOwner::kCoreOfTile ? tile.core : turn++ % cores;
      for (std::uint32_t k = 0; k < warp.texel_lines; ++k) asked.ask(items.texel_lines[next++], core);
    }
  }
  return asked.count();
}

}  // namespace tessera::replay
