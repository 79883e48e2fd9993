#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace tessera {

// Vectors and column-major matrices are GLM's: m * v transforms a column vector.
using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using Mat3 = glm::mat3;
using Mat4 = glm::mat4;
using DVec2 = glm::dvec2;
using DVec3 = glm::dvec3;
using DVec4 = glm::dvec4;
using DMat3 = glm::dmat3;
using DMat4 = glm::dmat4;
using DQuat = glm::dquat;

}  // namespace tessera
