#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "tests/replay/gltf_source.h"

namespace tessera::test {

// A triangle in scene 0, with the cameras "near" (in node "eye") and "far" (in a node without a name), and one that no
// scene holds; scene "other" has the triangle alone. "rise" and "sink" move the triangle, "turn" the first camera.
inline GltfSource view_asset() {
  using nlohmann::json;
  GltfSource source;
  json& d = source.document;
  d["meshes"] = {
      {{"primitives", {{{"attributes", {{"POSITION", source.positions({{-1, -1, 0}, {1, -1, 0}, {0, 1, 0.5f}})}}}}}}}};
  const auto camera = [](const char* name) {
    return json{{"name", name}, {"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.1}}}};
  };
  d["cameras"] = {camera("near"), camera("far"), camera("lost")};
  d["nodes"] = {{{"mesh", 0}, {"name", "triangle"}},
                {{"camera", 0}, {"name", "eye"}, {"translation", {0, 0, 5}}},
                {{"camera", 1}, {"translation", {0, 0, 9}}},
                {{"camera", 2}, {"name", "elsewhere"}}};
  d["scenes"] = {{{"name", "all"}, {"nodes", {0, 1, 2}}}, {{"name", "other"}, {"nodes", {0}}}};
  const int times = source.accessor(std::vector<float>{0, 1}, kFloatType, "SCALAR", {{"min", {0}}, {"max", {1}}});
  const auto animation = [&](const char* name, int node, const std::vector<float>& way) {
    const int values = source.accessor(way, kFloatType, "VEC3");
    return json{{"name", name},
                {"samplers", {{{"input", times}, {"output", values}}}},
                {"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", "translation"}}}}}}};
  };
  d["animations"] = {animation("rise", 0, {0, 0, 0, 0, 2, 0}), animation("sink", 0, {0, 0, 0, 0, -2, 0}),
                     animation("turn", 1, {0, 0, 5, 3, 0, 5})};
  return source;
}

}  // namespace tessera::test
