#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "timing/timing_model.h"
#include "timing/work.h"

namespace tessera::timing {

// The two queues of a frame, geometry and tiles, each by rising round: what may begin when. With machine.overlap=none a
// round's geometry begins when nothing is under way, and its tiles follow; else its geometry and its tiles begin as soon as the rounds that they wait for
// are stored (WorkRound::geometry_after, tiles_after), its tiles after its own geometry. With machine.overlap=frames the
// geometry of the first round is that of the next frame, which is taken to be like this one: it begins beside the last
// round's tiles.
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

  // The round whose geometry begins now; end_geometry() follows. `idle`: nothing is under way.
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
  // The round whose geometry it was.
  std::size_t end_geometry() {
    const std::size_t round = *geometry_;
    geometry_.reset();
    bound_[round] = true;
    count_stored();
    return round;
  }

  // Whether the tiles of one more round may be given out from now on.
  bool open_tiles() {
    if (opened_ == rounds_.size() || next_tile_ < tiles_open_ || !bound_[opened_] ||
        !stored(rounds_[opened_].tiles_after, opened_))
      return false;
    tiles_open_ += rounds_[opened_++].tiles.size();
    count_stored();
    return true;
  }
  // The tile that is given out next, as a position in Schedule::tiles; one behind the last that may be.
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
