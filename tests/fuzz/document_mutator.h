#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {

// Mutations that keep the outer form of an input, so that what changed gets past the first checks.

// Changes one to three places of a document: a value replaced, taken away, doubled, moved, or put under another name.
void mutate_document(nlohmann::json& document, Generator& random);

// The bytes as JSON, if they are that and nest less than a walk can take.
std::optional<nlohmann::json> parse_document(Bytes bytes);

// A JSON text. Falls back to plain bytes where the input is none or the result does not fit.
std::size_t mutate_json(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random);

// A .glb: document or binary chunk, with the lengths made right; a .gltf as mutate_json.
std::size_t mutate_capture(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random);

// Part of an input from byte `first` on, by libFuzzer's mutations; the bytes before stay.
std::size_t mutate_tail(std::uint8_t* data, std::size_t first, std::size_t size, std::size_t max_size);

// `text` where it fits, or nothing.
std::optional<std::size_t> store(const std::string& text, std::uint8_t* data, std::size_t max_size);

}  // namespace tessera::fuzz
