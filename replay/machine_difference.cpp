#include "replay/machine_difference.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/key_table.h"
#include "base/text.h"
#include "gpu/configuration.h"
#include "gpu/presets.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

json rows_of(const gpu::GpuConfiguration& a, const gpu::GpuConfiguration& b) {
  json rows = json::array();
  for (const auto& key : gpu::gpu_keys().keys()) {
    const json first = key_value_json(gpu::gpu_keys().value(a, key)),
               second = key_value_json(gpu::gpu_keys().value(b, key));
    if (first != second)
      rows.push_back({{"key", key.name},
                      {"a", first},
                      {"b", second},
                      {"unit", key.unit},
                      {"pass", key.timing ? "timing" : "function"},
                      {"meaning", key.meaning}});
  }
  return rows;
}

std::string title_of(const std::string& given, const gpu::GpuConfiguration& gpu) {
  std::string name = gpu.name, description = gpu.description;
  if (const gpu::Preset* preset = gpu::find_preset(given); preset != nullptr && name.empty())
    name = preset->name, description = preset->description;
  std::string text = escape_control(name.empty() || name == given ? given : fmt::format("{} ({})", name, given));
  return description.empty() ? text : text + ": " + escape_control(description);
}

}  // namespace

std::string value_text(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

json machine_difference(const std::string& a, const std::string& b) {
  return rows_of(gpu::load_gpu(a), gpu::load_gpu(b));
}

std::string machine_difference_text(const std::string& a, const std::string& b) {
  const gpu::GpuConfiguration first = gpu::load_gpu(a), second = gpu::load_gpu(b);
  std::string text = fmt::format("A  {}\nB  {}\n", title_of(a, first), title_of(b, second));
  const json rows = rows_of(first, second);
  if (rows.empty()) return text + "no key differs\n";
  text += fmt::format("\n{:<40} {:>14} {:>14}  {}\n", "key", "A", "B", "unit");
  for (const json& row : rows)
    text += fmt::format("{:<40} {:>14} {:>14}  {}\n", row["key"].get<std::string>(), value_text(row["a"]),
                        value_text(row["b"]), row["unit"].get<std::string>());
  return text;
}

}  // namespace tessera::replay
