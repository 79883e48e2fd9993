#pragma once

#include <filesystem>
#include <vector>

namespace tessera::scene::gltf {

// The files that a glTF file names: buffers, images, environments, whatever an extension or the application's own data
// call "uri". Data URIs and URIs with a scheme name no file. Reads the JSON as a stream and keeps the names alone; a file
// that is no glTF, or broken, names what stands before the fault. Nothing is checked, and nobody need be there.
std::vector<std::filesystem::path> named_files(const std::filesystem::path& file);

}  // namespace tessera::scene::gltf
