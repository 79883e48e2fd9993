#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tessera::test {

// Rows of a CSV file without quoted cells, by the names of its columns; a cell that a row lacks is empty.
std::vector<std::map<std::string, std::string>> csv_rows(const std::filesystem::path& file);

// "12 345" as a number. Throws std::invalid_argument when it does not begin with one.
std::uint64_t number_of(std::string digits);

}  // namespace tessera::test
