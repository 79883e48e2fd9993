#include <tessera/keys.h>

#include <utility>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "gpu/library/contents.h"

namespace tessera {
namespace {

using nlohmann::json;

json json_of(const Value& value) {
  return std::visit([](const auto& held) { return json(held); }, value);
}

Value value_of(const json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (value.is_number()) return value.get<double>();
  return value.get<std::string>();
}

template <class Table>
std::vector<KeyDescription> describe(const Table& table) {
  std::vector<KeyDescription> out;
  for (const auto& key : table.keys()) {
    const json row = describe_key(key, table.default_value(key));
    KeyDescription description;
    description.name = row.at("key");
    description.type = row.at("type");
    description.unit = row.at("unit");
    description.default_value = value_of(row.at("default"));
    // Reals that happen to be whole are still reals.
    if (description.type == "number") description.default_value = row.at("default").template get<double>();
    description.min = row.value("min", 0.0);
    description.max = row.value("max", 0.0);
    description.choices = row.value("choices", std::vector<std::string>());
    description.meaning = row.at("meaning");
    description.source = row.value("source", "");
    out.push_back(std::move(description));
  }
  return out;
}

// The table's row of a key; throws as a setter does if the table has none.
template <class Table>
const auto& row_of(const Table& table, std::string_view key) {
  if (const auto* row = table.find(key)) return *row;
  std::vector<std::string> known;
  for (const auto& row : table.keys()) known.emplace_back(row.name);
  throw UsageError(unknown_key_message(key, known));
}

template <class Table, class S>
Value get_value(const Table& table, const S& object, std::string_view key) {
  return value_of(key_value_json(table.value(object, row_of(table, key))));
}

}  // namespace

Gpu::Gpu(std::unique_ptr<Content> content) : content_(std::move(content)) {}
Gpu::Gpu(const std::string& preset_or_file)
    : content_(std::make_unique<Content>(Content{gpu::load_gpu(preset_or_file)})) {}
Gpu Gpu::from_json(std::string_view text) {
  return Gpu(std::make_unique<Content>(Content{gpu::parse_gpu(text, "JSON")}));
}
Gpu::Gpu(const Gpu& other) : content_(std::make_unique<Content>(*other.content_)) {}
Gpu::Gpu(Gpu&& other) noexcept = default;
Gpu& Gpu::operator=(const Gpu& other) {
  *this = Gpu(other);
  return *this;
}
Gpu& Gpu::operator=(Gpu&& other) noexcept = default;
Gpu::~Gpu() = default;

Gpu& Gpu::set(std::string_view key, const Value& value) {
  // row_of() refuses an unknown key.
  if (!gpu::set_gpu_key(std::string(key), json_of(value), content_->configuration)) row_of(gpu::gpu_keys(), key);
  return *this;
}
Value Gpu::get(std::string_view key) const { return get_value(gpu::gpu_keys(), content_->configuration, key); }
std::string Gpu::json() const { return gpu_json(content_->configuration).dump(1); }
std::vector<std::string> Gpu::presets() { return gpu::preset_names(); }
const std::vector<KeyDescription>& Gpu::keys() {
  static const std::vector<KeyDescription> kKeys = describe(gpu::gpu_keys());
  return kKeys;
}

Settings::Settings() : content_(std::make_unique<Content>()) {}
Settings::Settings(const Settings& other) : content_(std::make_unique<Content>(*other.content_)) {}
Settings::Settings(Settings&& other) noexcept = default;
Settings& Settings::operator=(const Settings& other) {
  *this = Settings(other);
  return *this;
}
Settings& Settings::operator=(Settings&& other) noexcept = default;
Settings::~Settings() = default;

Settings& Settings::set(std::string_view key, const Value& value) {
  const auto& table = gpu::settings_keys();
  table.set(content_->settings, row_of(table, key), json_of(value));
  return *this;
}
Value Settings::get(std::string_view key) const { return get_value(gpu::settings_keys(), content_->settings, key); }
std::string Settings::json() const { return settings_json(content_->settings).dump(1); }
const std::vector<KeyDescription>& Settings::keys() {
  static const std::vector<KeyDescription> kKeys = describe(gpu::settings_keys());
  return kKeys;
}

}  // namespace tessera
