#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/gltf_asset.h"

namespace tessera::test {

// A capture that must be refused; code makes it.
struct BrokenCapture {
  std::string name;
  // Writes the files into an empty folder and returns the capture.
  std::function<std::filesystem::path(const std::filesystem::path& folder)> make;
  std::string place;    // part of the message that gives the place: JSON pointer, "byte N"; empty: the file as a whole
  std::string fault;    // part of the message that gives the fault; empty: any
  int status = 3;       // 4: a limit refuses it, not its contents
  bool strict = false;  // only with --strict: its meaning is clear, and without --strict it loads with a note
};

struct BrokenClass {
  std::string name;  // of the law: "RefusesBroken..."
  std::vector<BrokenCapture> captures;
};

inline void PrintTo(const BrokenClass& c, std::ostream* out) { *out << c.captures.size() << " captures"; }

// ---- Ways to break a capture ------------------------------------------------------------------------------------

// Writes `contents` as the capture `name`.
std::filesystem::path put(const std::filesystem::path& folder, const std::string& name, const std::string& contents);

// everything_asset() after `damage`, as a .glb.
BrokenCapture damaged(std::string name, std::function<void(GltfAsset&)> damage, std::string place,
                      std::string fault = "");
// A file of these bytes.
BrokenCapture file_of(std::string name, std::string contents, std::string place, std::string fault = "");

// The same capture, refused only with --strict.
BrokenCapture strictly(BrokenCapture broken);

// ---- The corpus -------------------------------------------------------------------------------------------------

// Rows of the file beside this header. `set` changes or adds values of the document, `remove` removes them, both by
// JSON pointers into the document of `base` (everything_asset() unless the row names another).
nlohmann::json capture_rows(const std::string& file);
// Writes the capture of a row.
std::filesystem::path put_row(const std::filesystem::path& folder, const nlohmann::json& row);

// All broken captures. broken_captures.json has the captures that the document alone breaks, by class: `place` and
// `fault` are parts of the message; without a place it names the value that was set.
std::vector<BrokenClass> broken_captures();
std::vector<BrokenClass> broken_containers();   // GLB, JSON, URIs
std::vector<BrokenClass> broken_contents();     // values in buffers, Draco streams, images
std::vector<BrokenClass> broken_compression();  // compressed buffer views, WebP images

}  // namespace tessera::test
