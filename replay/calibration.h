#pragma once

#include <set>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace tessera::replay {

// Sources of the described machines' numbers: the rows of docs/calibration.md.

// The years of a source: the years in which the publications and parts that it names appeared, and kYearRead if it is
// an assumption, a measurement, or the code of a driver, which has no date of its own.
inline constexpr int kYearRead = 2026;
std::set<int> source_years(std::string_view source);

// A row for each number of "mid-mobile", followed by the presets' rows for numbers of which they have values of their
// own: {"key", "preset", "value", "unit", "low", "high", "source", "date", "meaning"}. Numbers that are assumed, at
// least in part, have "low" and "high", the values that `--sensitivity` sets.
nlohmann::json calibration_rows();

// The page's text above its table: how many of the default machine's numbers are published, and the meaning of the
// columns.
std::string calibration_introduction();

}  // namespace tessera::replay
