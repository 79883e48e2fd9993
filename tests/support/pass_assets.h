#pragma once

#include <nlohmann/json.hpp>

namespace tessera::test {

// Members of TESSERA_capture that describe a deferred renderer with bloom: the example of the extension's page.
inline nlohmann::json deferred_passes() {
  return nlohmann::json::parse(R"({
    "attachments": {
      "albedo": {"format": "rgba8"}, "normal": {"format": "rgb10a2"}, "pbr": {"format": "rgba8"},
      "lit": {"format": "rgba16f"}, "glow": {"format": "r11g11b10f", "scale": 0.5, "levels": 5}
    },
    "passes": [
      {"name": "main", "subpasses": [
        {"draw": "opaque", "shader": "gbuffer", "write": ["albedo", "normal", "pbr"]},
        {"shader": "light", "input": ["albedo", "normal", "pbr", "depth"], "write": ["lit"]},
        {"draw": "blended", "shader": "forward", "write": ["lit"]}]},
      {"name": "bloom", "shader": "bloom", "sample": ["lit"], "write": ["glow"]},
      {"name": "final", "shader": "tonemap", "sample": ["lit", "glow"], "write": ["frame"]}
    ]
  })");
}

}  // namespace tessera::test
