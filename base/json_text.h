#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace tessera {

// Parses JSON from an untrusted file. Refuses (InputError with the byte offset) what is not JSON, what nests deeper
// than `max_depth` and numbers that overflow a double.
nlohmann::json parse_json(std::string_view text, const std::string& file, int max_depth = 64);

// The same for what people write by hand: also refuses an object that has a key twice, with its JSON pointer.
nlohmann::json parse_unique_json(std::string_view text, const std::string& file, int max_depth = 64);

// The same from a stream, for files that are too large for the memory: calls keep(element) for each element of the array
// `array` of the outermost object, and leaves out those for which it returns false. Elements must be objects.
nlohmann::json parse_json_array(std::istream& stream, const std::string& file, std::string_view array,
                                const std::function<bool(const nlohmann::json&)>& keep, int max_depth = 64);

// JSON text. Bytes of a file's name that are no UTF-8, which JSON cannot hold, become U+FFFD. `indent` < 0: one line.
std::string json_text(const nlohmann::json& value, int indent = -1);

// A whole number that an int holds. Throws nlohmann::json::exception for anything else: get<int>() would convert 1e20
// or true somehow.
int whole_number(const nlohmann::json& value);

// One step of a JSON pointer (RFC 6901): "/" and the key, its own '~' and '/' escaped.
std::string pointer_step(std::string_view key);

}  // namespace tessera
