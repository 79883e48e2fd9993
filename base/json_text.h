#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace tessera {

// Parses JSON from an untrusted file. Refuses (InputError with the byte offset) what is not JSON, what nests deeper
// than `max_depth` and numbers that overflow a double.
nlohmann::json parse_json(std::string_view text, const std::string& file, int max_depth = 64);

// A whole number that an int holds. Throws nlohmann::json::exception for anything else: get<int>() would convert 1e20
// or true somehow.
int whole_number(const nlohmann::json& value);

// One step of a JSON pointer (RFC 6901): "/" and the key, its own '~' and '/' escaped.
std::string pointer_step(std::string_view key);

}  // namespace tessera
