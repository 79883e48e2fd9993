#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// Data of a page that is not in its head: script elements that hold packed data, which the page unpacks on demand: see
// page/store.js and page/packed.js.

std::string base64(std::string_view bytes);
std::string gzip_base64(std::string_view text);

// The text with the characters of markup escaped.
std::string markup_text(const std::string& text);

// Script elements with packed data, as markup: `first` stands before the scripts of the page, which draw the first screen from it,
// and `rest` behind them.
struct PageElements {
  std::string first, rest;
};

// <script type="text/plain" id="ID">TEXT</script>; `text` is base64.
void append_script(const std::string& id, std::string_view text, std::string& page);

// Packs similar documents that consist mostly of numbers. Each array of kLeastColumn whole numbers or more becomes
// {"column": [length, way]}, and its numbers follow the JSON as zigzag varints, in the order of the documents and of
// their keys: differences from the previous number (way 0) or from the same number of the previous document (way 1),
// whichever is smaller.
// Arrays of arrays of whole numbers of kLeastColumn or more become {"lists": column of lengths, "of": column of
// numbers}.
//   u32 bytes of JSON, little endian; JSON: an array of documents; varints
// Numbers must be below 2^52 in magnitude.
inline constexpr std::size_t kLeastColumn = 16;
std::string pack_documents(const std::vector<nlohmann::json>& documents);

// The files of replay/report/page/ by name, built into the program.
const std::map<std::string_view, std::string_view>& page_files();

// Folders that are searched for Vega's modules, in order. The environment variable TESSERA_VEGA, if set, is the only
// one. Otherwise: the folder that the build was given (TESSERA_VEGA_FOLDER), and below each of XDG_DATA_HOME and
// XDG_DATA_DIRS (by default ~/.local/share, /usr/local/share, /usr/share) the folders that distributions and npm use.
std::vector<std::filesystem::path> vega_folders();

// The file of a module ("vega-util"): FOLDER/vega-util.min.js, or FOLDER/vega-util/build/vega-util.min.js as npm has
// it. Empty when no folder holds it.
std::filesystem::path find_vega_module(const std::string& name);

}  // namespace tessera::replay
