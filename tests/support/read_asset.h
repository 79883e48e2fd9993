#pragma once

#include <string>

#include "scene/capture_reader.h"
#include "tests/support/captures.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/temporary_folder.h"

namespace tessera::test {

// The capture in a file of these contents, .glb or .gltf.
inline scene::Capture read_contents(const std::string& contents, const scene::CaptureLimits& limits = {}) {
  const TemporaryFolder folder;
  write_text(folder / "f.glb", contents);
  return scene::read_capture(folder / "f.glb", limits);
}
inline scene::Capture read_asset(const GltfAsset& asset, const scene::CaptureLimits& limits = {}) {
  return read_contents(asset.glb(), limits);
}

}  // namespace tessera::test
