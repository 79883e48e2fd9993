#pragma once

#include <string>
#include <vector>

#include "scene/capture.h"
#include "scene/made_capture.h"

namespace tessera::replay::stability {

// A small scene made in memory, and its view. The shutter is open for one second from 0 on, so that keys of animations
// are shares of the shutter.
struct Stage {
  scene::Capture capture;
  int width = 160, height = 90;
  std::vector<std::string> keys{};  // "tile.width=16": settings of the machine that the case needs
  int frame = 0;

  Stage();

  int material(const scene::Material& material);
  // Adds a white material without light, visible from both sides.
  int flat(const Vec4& color, scene::AlphaMode mode = scene::AlphaMode::kOpaque);
  // Adds a lit material, displaced by random heights of a texture of 8 x 8 texels, height * scale + bias.
  int displaced(float scale, float bias, std::uint32_t seed = 1);

  // Adds a mesh of one primitive and a node that draws it; returns the node.
  int add(scene::Primitive primitive, const DVec3& at = DVec3(0.0));
  // Adds a camera at `eye` that looks along -z; returns its node.
  int look(const DVec3& eye, const scene::Camera& camera = {});
  // Adds an orthographic camera: one unit is a pixel, and the middle of the image is the origin.
  int look_flat();
  // Moves all roots below a node; returns it.
  int below(const scene::Transform& transform);

  scene::Node& node(int number) { return capture.nodes[static_cast<std::size_t>(number)]; }

  void play(const scene::AnimationChannel& channel);
  void move(int node, const DVec3& way);
  // Turns a node at constant speed about an axis.
  void turn(int node, const Vec3& axis, double turns);
  // Moves a property from `a` to `b` and back to `a`, `cycles` times.
  void zigzag(int node, scene::AnimatedPath path, const std::vector<float>& a, const std::vector<float>& b, int cycles);
  // Animates the node's only morph target from 0 to 1.
  void morph(int node);
  // Adds joints that carry the vertices of a node's mesh: one joint carries all; several carry them by their x from
  // `low` to `high`, from joint to joint. Returns the number of the first joint's node.
  int skin(int node, int joints, float low = 0, float high = 0);
  void still() { capture.settings.shutter_close = 0; }
};

// Deterministic pseudo-random numbers (Steele, Lea and Flood 2014, SplitMix64).
class FixedRandom {
 public:
  explicit FixedRandom(std::uint64_t seed) : state_(seed) {}
  float uniform(float low, float high);
  Vec3 in_box(float half);

 private:
  std::uint64_t state_;
};

using scene::made::closed_patches, scene::made::flat_patch, scene::made::patches, scene::made::triangles;

// A quad with these corners in order; two triangles.
scene::Primitive quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material);
// A sheet of (columns + 1) x (rows + 1) vertices over the box from `low` to `high`.
scene::Primitive sheet(int columns, int rows, Vec2 low, Vec2 high, int material);

}  // namespace tessera::replay::stability
