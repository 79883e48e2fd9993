#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "scene/assembly.h"
#include "scene/capture.h"
#include "scene/frame_geometry.h"
#include "scene/made_capture.h"

namespace tessera::test {

// ---- Captures made in memory ------------------------------------------------------------------------------------

using scene::made::add_camera, scene::made::add_material, scene::made::add_morph, scene::made::add_node;
using scene::made::closed_patches, scene::made::flat_patch, scene::made::patches, scene::made::play,
    scene::made::triangles;

// A channel's part that moves a number of a material, by the pointer below the material.
int material_number(std::string_view pointer);
// Moves a node linearly from where it is by `way` during the first second.
void add_motion(scene::Capture& capture, int node, const DVec3& way);
// Turns a node by an angle about an axis during the first second.
void add_turn(scene::Capture& capture, int node, const Vec3& axis, float angle);

// Triangles over n x n cells of random heights.
scene::Primitive wavy_grid(int n, std::uint32_t seed);
// Points, or segments by both ends of each.
scene::Primitive points(const std::vector<Vec3>& positions, int material = scene::kNone);
scene::Primitive segments(const std::vector<Vec3>& ends, int material = scene::kNone);

// A displacement texture of the given heights.
scene::Displacement displacement(int width, int height, std::vector<float> heights, float scale, float bias);

// ---- Randomness -------------------------------------------------------------------------------------------------

// Fixed-seed generator with the few draws that tests need.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  float uniform(float low, float high) { return low + (high - low) * static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  int integer(int low, int high) {
    const std::uint32_t count = static_cast<std::uint32_t>(high) - static_cast<std::uint32_t>(low) + 1;  // 0: all
    const auto drawn = static_cast<std::uint32_t>(engine_());
    return static_cast<int>(static_cast<std::uint32_t>(low) + (count == 0 ? drawn : drawn % count));
  }
  bool coin() { return (engine_() & 1) != 0; }
  Vec3 in_box(float half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }

 private:
  std::mt19937 engine_;
};

// ---- Files ------------------------------------------------------------------------------------------------------

// A capture that ships with the project, by name without ending.
std::filesystem::path shipped_capture(const std::string& name);
// The folder of sample models (environment variable TESSERA_ASSETS, else ../shared/assets beside the project), or
// nothing: tests that need it then skip.
std::optional<std::filesystem::path> assets_folder();
std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace tessera::test
