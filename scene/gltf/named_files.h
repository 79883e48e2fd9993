#pragma once

#include <filesystem>
#include <vector>

namespace tessera::scene::gltf {

// The files that a glTF file names: buffers, images, environments, and every "uri" of an extension or of the
// application's own data. Data URIs and URIs with a scheme name no file. Reads the JSON as a stream and keeps the names
// alone; for a file that is broken or no glTF it returns the names before the fault. Checks nothing; the named files
// may be missing.
std::vector<std::filesystem::path> named_files(const std::filesystem::path& file);

}  // namespace tessera::scene::gltf
