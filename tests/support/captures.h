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

namespace tessera::test {

// ---- Captures made in memory ------------------------------------------------------------------------------------

// Adds a material and returns its number.
int add_material(scene::Capture& capture, scene::Material material = {});
// Adds a mesh of one primitive and a node that draws it; returns the node.
int add_node(scene::Capture& capture, scene::Primitive primitive, const DVec3& translation = DVec3(0.0));
// A camera at `eye` that looks along -z.
void add_camera(scene::Capture& capture, const DVec3& eye, const scene::Camera& camera = {});
// The part of a channel that moves a number of a material, by its pointer there.
int material_number(std::string_view pointer);
// Adds a channel to the animation that plays.
void play(scene::Capture& capture, const scene::AnimationChannel& channel);
// Moves a node linearly from where it is by `way` during the first second.
void add_motion(scene::Capture& capture, int node, const DVec3& way);
// The node's only morph target comes in.
void add_morph(scene::Capture& capture, int node);
// Turns a node by an angle about an axis during the first second.
void add_turn(scene::Capture& capture, int node, const Vec3& axis, float angle);

scene::Primitive triangles(std::vector<Vec3> positions, std::vector<std::uint32_t> indices,
                           int material = scene::kNone);
// Triangles over n x n cells of random heights.
scene::Primitive wavy_grid(int n, std::uint32_t seed);
// Points, or segments by both ends of each.
scene::Primitive points(const std::vector<Vec3>& positions, int material = scene::kNone);
scene::Primitive segments(const std::vector<Vec3>& ends, int material = scene::kNone);
// Bezier patches of 16 control points each.
scene::Primitive patches(std::vector<Vec3> control_points, int material = scene::kNone);
// 16 control points of the flat patch p(u,v) = origin + u * a + v * b.
std::vector<Vec3> flat_patch(Vec3 origin, Vec3 a, Vec3 b);
// A closed surface of six patches: a cube pushed towards a sphere of radius 1; texture coordinates per face.
scene::Primitive closed_patches(int material);

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
