#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tessera {

// Replaces control characters, DEL and bytes that are not valid UTF-8 by \xNN, and shortens texts of more than
// `limit` bytes (the middle is replaced by "..."). For messages that quote a file.
std::string escape_control(std::string_view text, std::size_t limit = 240);

// Number of single-character insertions, deletions, replacements and swaps of neighbours between two texts, with no
// character touched by more than one of them (optimal string alignment). Returns most + 1 where the number exceeds
// `most`; the time is proportional to the shorter text times `most`.
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t most = SIZE_MAX);

// The candidate closest to `name`, the first of equally close ones, or "" when none is within half of the name's
// length. The time grows with the length of the name plus the lengths of all candidates, even for a very long name.
std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

// "1.5 MiB", "812 B": for people; files carry plain bytes.
std::string human_bytes(std::uint64_t bytes);

}  // namespace tessera
