#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
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

// The files of replay/report/page/ by name, built into the program.
const std::map<std::string_view, std::string_view>& page_files();

// Folders in which Vega's modules are looked for, first come first served. The environment variable TESSERA_VEGA, where
// set, is the only one; else the folder that the build was given (TESSERA_VEGA_FOLDER), and below each of XDG_DATA_HOME
// and XDG_DATA_DIRS (by default ~/.local/share, /usr/local/share, /usr/share) the folders that distributions and npm
// use.
std::vector<std::filesystem::path> vega_folders();

// The file of a module ("vega-util"): FOLDER/vega-util.min.js, or FOLDER/vega-util/build/vega-util.min.js as npm has
// it. Empty when no folder holds it.
std::filesystem::path find_vega_module(const std::string& name);

}  // namespace tessera::replay
