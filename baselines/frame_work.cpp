#include "baselines/frame_work.h"

#include <algorithm>
#include <utility>

#include "base/check.h"
#include "baselines/surfaces.h"

namespace tessera::baselines {

void FrameWorkJoin::add(timing::FrameWork pass, std::string_view name, bool waits) {
  const auto number = static_cast<std::uint32_t>(frame_.passes.size());
  frame_.passes.emplace_back(name);
  if (!waits && !pass.rounds.empty()) pass.rounds.front().geometry_after = 0;
  for (timing::WorkRound& round : pass.rounds) {
    round.pass = number;
    frame_.rounds.push_back(std::move(round));
    state_bytes_.push_back(pass.tile_state_bytes);
  }
  frame_.other_bytes += pass.other_bytes;
  frame_.other_written_bytes += pass.other_written_bytes;
}

void FrameWorkJoin::add_images(std::span<const timing::WorkRound> rounds, std::span<const gpu::PassResult> names) {
  TESSERA_CHECK(rounds.size() == names.size() && !state_bytes_.empty(), "a pass over images has a round");
  for (std::size_t k = 0; k < rounds.size(); ++k) {
    frame_.passes.push_back(names[k].name);
    timing::WorkRound& round = frame_.rounds.emplace_back(rounds[k]);
    round.pass = static_cast<std::uint32_t>(frame_.passes.size() - 1);
    for (timing::TileWork& tile : round.tiles) tile.extra_bytes = 0;
    state_bytes_.push_back(state_bytes_.back());
  }
}

timing::FrameWork FrameWorkJoin::finish() {
  if (!state_bytes_.empty()) frame_.tile_state_bytes = *std::min_element(state_bytes_.begin(), state_bytes_.end());
  for (std::size_t r = 0; r < state_bytes_.size(); ++r)
    for (timing::TileWork& tile : frame_.rounds[r].tiles) tile.extra_bytes += state_bytes_[r] - frame_.tile_state_bytes;
  state_bytes_.clear();
  return std::exchange(frame_, {});
}

BaselineCounters image_pass_counters(const gpu::FrameCounters& pass) {
  const memory::Traffic all = pass.ledger.total();
  BaselineCounters out;
  out.texture_bytes = looked_up_bytes(pass.ledger);
  out.frame_bytes_read = all.read_bytes - out.texture_bytes;
  out.frame_bytes_written = all.written_bytes;
  out.dram_bytes = out.dram_bytes_uncached = out.frame_bytes_read + out.frame_bytes_written;
  return out;
}

}  // namespace tessera::baselines
