#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// What lies in the page beside its head, in script elements of their own, and is unpacked when it is looked at: see
// page/store.js and page/packed.js.

std::string base64(std::string_view bytes);
std::string gzip_base64(std::string_view text);

// Nothing in it looks like markup.
std::string markup_text(const std::string& text);

// <script type="text/plain" id="ID">TEXT</script>; `text` is base64.
void append_script(const std::string& id, std::string_view text, std::string& page);

// Documents that are alike, of numbers for the most part: each array of kLeastColumn whole numbers or more becomes
// {"column": [length, way]} and its numbers go, as zigzag varints in the order of the documents and of their keys, behind
// the JSON: the difference to the number before (way 0) or to that of the document before (way 1), whichever takes less.
// Arrays of arrays of whole numbers of kLeastColumn or more become {"lists": column of lengths, "of": column of numbers}.
//   u32 bytes of JSON, little endian; JSON: an array of documents; varints
// Numbers must be below 2^52 in magnitude.
inline constexpr std::size_t kLeastColumn = 16;
std::string pack_documents(const std::vector<nlohmann::json>& documents);

}  // namespace tessera::replay
