#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "timing/timing_model.h"
#include "timing/work.h"

namespace tessera::timing {

// The two queues of a frame, geometry and tiles, each by rising round; they decide which work may begin. With
// machine.overlap=none a round's geometry begins when no work is in progress, and its tiles follow. Otherwise
// geometry and tiles of a round begin as soon as the rounds that they wait for are stored (WorkRound::geometry_after,
// tiles_after), the tiles after their own geometry. With machine.overlap=frames the first round's geometry belongs to
// the next frame, which is assumed to equal this one: it begins beside the last round's tiles.
//
// Invariants (cited by the tests):
//   RQ1  Geometry runs one round at a time; tiles of a round are given out after its geometry and after all tiles of the
//        round before were given out.
class RoundQueues {
 public:
  RoundQueues(const hardware::Machine& gpu, const FrameWork& work)
      : rounds_(work.rounds),
        sequential_(gpu.queues.overlap == hardware::FrameOverlap::kNone),
        next_frame_(overlaps(gpu)) {
    for (const WorkRound& round : rounds_) left_.push_back(round.tiles.size());
    bound_.assign(rounds_.size(), false);
    if (next_frame_ && !rounds_.empty()) bound_.front() = true;
    next_geometry_ = next_frame_ ? 1 : 0;
  }

  // Begins a round's geometry and returns the round; end_geometry() must follow. `idle`: no work is in progress.
  std::optional<std::size_t> begin_geometry(bool idle) {
    if (geometry_) return std::nullopt;
    if (next_geometry_ < rounds_.size()) {
      if ((sequential_ && !idle) || !stored(rounds_[next_geometry_].geometry_after, next_geometry_))
        return std::nullopt;
      return geometry_ = next_geometry_++;
    }
    if (!next_frame_ || opened_ < rounds_.size() || rounds_.empty()) return std::nullopt;
    next_frame_ = false;
    return geometry_ = 0;
  }
  // Ends the geometry and returns its round.
  std::size_t end_geometry() {
    const std::size_t round = *geometry_;
    geometry_.reset();
    bound_[round] = true;
    count_stored();
    return round;
  }

  // Opens the tiles of one more round if they may begin; returns whether it did.
  bool open_tiles() {
    if (opened_ == rounds_.size() || next_tile_ < tiles_open_ || !bound_[opened_] ||
        !stored(rounds_[opened_].tiles_after, opened_))
      return false;
    tiles_open_ += rounds_[opened_++].tiles.size();
    count_stored();
    return true;
  }
  // The next tile to give out, as a position in Schedule::tiles, and the end of the tiles that may be given out.
  std::size_t next_tile() const { return next_tile_; }
  std::size_t tiles_open() const { return tiles_open_; }
  void give_tile() { ++next_tile_; }
  void tile_stored(std::size_t round) {
    --left_[round];
    count_stored();
  }

  bool done() const { return stored_ == rounds_.size() && !geometry_ && !(next_frame_ && !rounds_.empty()); }

 private:
  bool stored(std::uint32_t after, std::size_t round) const {
    return stored_ >= (sequential_ ? round : std::min<std::size_t>(after, round));
  }
  void count_stored() {
    while (stored_ < opened_ && left_[stored_] == 0) ++stored_;
  }

  const std::vector<WorkRound>& rounds_;
  bool sequential_, next_frame_;
  std::vector<std::size_t> left_;  // tiles that are not stored, by round
  std::vector<bool> bound_;        // rounds whose geometry is done
  std::optional<std::size_t> geometry_;
  std::size_t next_geometry_ = 0, opened_ = 0, stored_ = 0, next_tile_ = 0, tiles_open_ = 0;
};

// All tiles of a frame, round by round, without times.
inline std::vector<TileSchedule> tiles_of(const FrameWork& work) {
  std::vector<TileSchedule> tiles;
  for (std::uint32_t r = 0; r < work.rounds.size(); ++r)
    for (std::uint32_t i = 0; i < work.rounds[r].tiles.size(); ++i) {
      TileSchedule& tile = tiles.emplace_back();
      tile.round = r, tile.index = i;
    }
  return tiles;
}

}  // namespace tessera::timing
