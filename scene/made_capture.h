#pragma once

#include <cstdint>
#include <vector>

#include "scene/capture.h"

// Captures made in memory, piece by piece: small scenes for tests and for `selfcheck --stability`.
namespace tessera::scene::made {

// Adds a material and returns its number.
int add_material(Capture& capture, Material material = {});
// Adds a mesh of one primitive and a node that draws it; returns the node.
int add_node(Capture& capture, Primitive primitive, const DVec3& translation = DVec3(0.0));
// Adds a camera at `eye` that looks along -z; returns its node.
int add_camera(Capture& capture, const DVec3& eye, const Camera& camera = {});
// A rotation that turns -z, along which cameras and lights look, towards a direction. For a direction straight down,
// the image's up is -z.
DQuat looking(const DVec3& direction);
// Adds a light at a place that looks along a direction and casts shadows; returns its node.
int add_light(Capture& capture, const shaders::Light& light, const DVec3& place, const DVec3& direction,
              const ShadowRequest& maps = {});
// Adds a channel to the played animation.
void play(Capture& capture, const AnimationChannel& channel);
// Animates the node's only morph target from 0 to 1 during the first second.
void add_morph(Capture& capture, int node);

Primitive triangles(std::vector<Vec3> positions, std::vector<std::uint32_t> indices, int material = kNone);
// Bezier patches of 16 control points each.
Primitive patches(std::vector<Vec3> control_points, int material = kNone);
// 16 control points of the flat patch p(u,v) = origin + u * a + v * b.
std::vector<Vec3> flat_patch(const Vec3& origin, const Vec3& a, const Vec3& b);
// A closed surface of six patches: a cube pushed towards a sphere of radius 1; texture coordinates per face.
Primitive closed_patches(int material);

}  // namespace tessera::scene::made
