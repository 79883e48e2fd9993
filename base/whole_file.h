#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace tessera {

// Reads a whole regular file. Throws InputError when it is missing, not a regular file or cannot be read, LimitError
// when it is larger than max_bytes. Messages call it `display_name`. `charge` (may be empty) receives the bytes before
// they are allocated, and may throw.
std::vector<std::uint8_t> read_whole_file(const std::filesystem::path& file, std::uint64_t max_bytes,
                                          const std::string& display_name,
                                          const std::function<void(std::uint64_t)>& charge = {});

// The same as text, for files in folders that the program made.
std::string read_whole_text(const std::filesystem::path& file, std::uint64_t max_bytes = std::uint64_t{1} << 30);

}  // namespace tessera
