#pragma once

#include <set>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace tessera::replay {

// Where the numbers of the described machines come from: the rows of docs/calibration.md.

// The years of a source: those in which the publications and parts that it names appeared, and kYearRead if it is an
// assumption, a measurement, or the code of a driver, which has no date of its own.
inline constexpr int kYearRead = 2026;
std::set<int> source_years(std::string_view source);

// A row for each number of "mid-mobile", followed by those of the presets that have a value of their own for it:
// {"key", "preset", "value", "unit", "low", "high", "source", "date", "meaning"}. Numbers that are assumed, at least in
// part, have "low" and "high": where `--sensitivity` puts them.
nlohmann::json calibration_rows();

// The page's text above its table: how many of the default machine's numbers are published, and what columns mean.
std::string calibration_introduction();

}  // namespace tessera::replay
