#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tessera {

// Replaces control characters, DEL and bytes that are not valid UTF-8 by \xNN, and shortens texts of more than
// `limit` bytes (the middle is replaced by "..."). For messages that quote a file.
std::string escape_control(std::string_view text, std::size_t limit = 240);

// Number of single-character insertions, deletions, replacements and swaps of neighbours between two texts, no
// character touched by more than one of them (optimal string alignment); most + 1 where it is more than `most`, which
// takes time by the shorter text times `most`.
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t most = SIZE_MAX);

// The candidate closest to `name`, the first of equally close ones, or "" when none is within half of the name's
// length. A name of any length takes time by its length once and by that of each candidate.
std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

// "1.5 MiB", "812 B": for people; files carry plain bytes.
std::string human_bytes(std::uint64_t bytes);

}  // namespace tessera
