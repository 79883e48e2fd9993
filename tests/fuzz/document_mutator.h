#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/fuzz/fuzz_target.h"

namespace tessera::fuzz {

// Mutations that keep the outer form of an input, so that the change gets past the first checks.

// Changes one to three places of a document: a value is replaced, removed, doubled, moved, or put under another name.
void mutate_document(nlohmann::json& document, Generator& random);

// Parses the bytes as JSON; nothing where they are not JSON or nest too deeply for a recursive walk.
std::optional<nlohmann::json> parse_document(Bytes bytes);

// Mutates a JSON text. Falls back to plain bytes where the input is no JSON or the result does not fit.
std::size_t mutate_json(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random);

// Mutates the document or the binary chunk of a .glb and corrects the lengths; a .gltf as mutate_json().
std::size_t mutate_capture(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random);

// Mutates the input from byte `first` on by libFuzzer's mutations; the bytes before it stay.
std::size_t mutate_tail(std::uint8_t* data, std::size_t first, std::size_t size, std::size_t max_size);

// Copies `text` where it fits and returns its size, or nothing.
std::optional<std::size_t> store(const std::string& text, std::uint8_t* data, std::size_t max_size);

}  // namespace tessera::fuzz
