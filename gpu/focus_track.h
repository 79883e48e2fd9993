#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/vec.h"

namespace tessera::gpu {

// Where an eye looked, as a tracker writes it down: lines of three numbers between commas, seconds, then the place in
// frame widths from the left and frame heights from the top. The first line may be the head "time,x,y". Times increase;
// a place may lie outside the frame. Between two lines the eye goes straight and evenly; before the first and after the
// last it rests.
class FocusTrack {
 public:
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 20;
  static constexpr std::size_t kMaxLines = 1'000'000;
  static constexpr double kFarthest = 10;  // widths and heights

  // Throws InputError that names file and line, LimitError for more than kMaxBytes or kMaxLines.
  static FocusTrack read(const std::filesystem::path& file);
  // `name` is what messages call it.
  static FocusTrack parse(std::string_view text, const std::string& name);

  DVec2 at(double seconds) const;
  std::size_t size() const { return points_.size(); }

 private:
  struct Point {
    double time;
    DVec2 place;
  };
  std::vector<Point> points_;  // one at least
};

}  // namespace tessera::gpu
