#include "gpu/focus_track.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "base/whole_file.h"

namespace tessera::gpu {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::optional<double> number_of(std::string_view cell) {
  double number = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), number);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

// Three cells; fewer or more: nothing.
std::optional<std::array<std::string_view, 3>> cells_of(std::string_view line) {
  std::array<std::string_view, 3> cells;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t comma = line.find(',');
    if ((comma == std::string_view::npos) != (c == 2)) return std::nullopt;
    cells[c] = trimmed(line.substr(0, comma));
    line.remove_prefix(c == 2 ? line.size() : comma + 1);
  }
  return cells;
}

}  // namespace

FocusTrack FocusTrack::read(const std::filesystem::path& file) {
  const std::vector<std::uint8_t> bytes = read_whole_file(file, kMaxBytes, file.string());
  return parse({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, file.string());
}

FocusTrack FocusTrack::parse(std::string_view text, const std::string& name) {
  FocusTrack track;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() && trimmed(text).empty()) continue;  // what ends the file
    const auto refuse = [&](const std::string& fault) {
      throw InputError(name, fmt::format("line {}", number), fault);
    };
    if (track.points_.size() == kMaxLines)
      throw LimitError(fmt::format("{}: a focus track has at most {} lines", name, kMaxLines));
    const auto cells = cells_of(line);
    if (!cells) refuse(fmt::format("'{}' is not 'time,x,y'", escape_control(line, 80)));
    if (number == 1 && (*cells)[0] == "time" && (*cells)[1] == "x" && (*cells)[2] == "y") continue;
    std::array<double, 3> value{};
    for (std::size_t c = 0; c < 3; ++c) {
      const std::optional<double> found = number_of((*cells)[c]);
      if (!found) refuse(fmt::format("'{}' is not a number", escape_control((*cells)[c], 80)));
      value[c] = *found;
    }
    if (std::abs(value[1]) > kFarthest || std::abs(value[2]) > kFarthest)
      refuse(fmt::format("x and y are frame widths and heights, from {} to {}", -kFarthest, kFarthest));
    if (!track.points_.empty() && !(value[0] > track.points_.back().time))
      refuse(fmt::format("time {} does not come after {}", value[0], track.points_.back().time));
    track.points_.push_back({value[0], {value[1], value[2]}});
  }
  if (track.points_.empty()) throw InputError(name, "", "holds no line 'time,x,y'");
  return track;
}

DVec2 FocusTrack::at(double seconds) const {
  const auto after = std::upper_bound(points_.begin(), points_.end(), seconds,
                                      [](double time, const Point& point) { return time < point.time; });
  if (after == points_.begin()) return points_.front().place;
  if (after == points_.end()) return points_.back().place;
  const Point &a = *(after - 1), &b = *after;
  return a.place + (b.place - a.place) * ((seconds - a.time) / (b.time - a.time));
}

}  // namespace tessera::gpu
