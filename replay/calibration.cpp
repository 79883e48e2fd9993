#include "replay/calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <regex>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/key_table.h"
#include "gpu/configuration.h"
#include "gpu/presets.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Years of the announcement, publication or grant of items that sources name without a year.
constexpr std::pair<std::string_view, int> kPublished[] = {
    {"Adreno 530", 2015},      {"Adreno 610", 2019},  {"Adreno 630", 2017}, {"Adreno 680", 2018},
    {"Adreno 730", 2021},      {"Direct3D 11", 2009}, {"LPDDR4 ", 2014},    {"LPDDR4-", 2014},
    {"LPDDR4X", 2017},         {"LPDDR5X", 2021},     {"Mali-G31", 2018},   {"Mali-G51", 2016},
    {"Mali-G57", 2019},        {"Mali-G715", 2022},   {"OpenGL ES", 2015},  {"RDNA2", 2020},
    {"Raspberry Pi 4", 2019},  {"US 8791945", 2014},  {"US 9626762", 2017}, {"Vulkan", 2016},
    {"Immortalis-G720", 2023}, {"Linux", kYearRead},  {"Mesa", kYearRead},
};
const std::string kDefaultPreset = gpu::GpuConfiguration().preset;

bool names(std::string_view source, std::string_view word) { return source.find(word) != std::string_view::npos; }
bool is_own(std::string_view source) { return names(source, "[assumed]") || names(source, "[measured]"); }

// The key to which a source refers, as in "as tile.width" (see kReference).
std::string referred_key(const std::string& source) {
  static const std::regex kReference(R"(\b(?:as|the type of) ([a-z_0-9]+\.[a-z_0-9]+))");
  std::smatch found;
  return std::regex_search(source, found, kReference) ? found[1].str() : "";
}

// The source of a preset's number: the preset's own text, else the key's.
std::string source_of(const gpu::Preset& preset, std::string_view key) {
  const std::string name(key);
  if (const auto own = preset.sources.find(name); own != preset.sources.end()) return *own;
  const auto* row = gpu::gpu_keys().find(key);
  return row == nullptr ? "" : std::string(row->source);
}

std::string date_of(const gpu::Preset& preset, std::string_view key) {
  const std::string source = source_of(preset, key), other = referred_key(source);
  std::set<int> years = source_years(source);
  if (!other.empty() && other != key) {
    if (!is_own(source) && years == std::set<int>{kYearRead}) years.clear();  // it names the other key alone
    years.merge(source_years(source_of(preset, other)));
  }
  return fmt::format("{}", fmt::join(years, ", "));
}

std::optional<double> number_of(const KeyValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* number = std::get_if<double>(&value)) return *number;
  return std::nullopt;
}

template <class S>
json row_of(const gpu::Preset& preset, const Key<S>& key, const KeyValue& value, double default_value) {
  json row = {{"key", key.name},
              {"preset", preset.name},
              {"value", key_value_json(value)},
              {"unit", key.unit},
              {"source", source_of(preset, key.name)},
              {"date", date_of(preset, key.name)},
              {"meaning", key.meaning}};
  if (key.assumed() || key.ends) {
    const PlausibleRange ends = key_ends(key, *number_of(value), default_value);
    const bool whole = std::holds_alternative<std::int64_t>(value);
    row["low"] = whole ? std::floor(ends.low) : ends.low;
    row["high"] = whole ? std::floor(ends.high) : ends.high;
  }
  return row;
}

}  // namespace

std::set<int> source_years(std::string_view source) {
  static const std::regex kYear(R"(\b(?:19[89]|20[0-2])[0-9]\b)");
  std::set<int> years;
  const std::string text(source);
  for (std::sregex_iterator year(text.begin(), text.end(), kYear), end; year != end; ++year)
    years.insert(std::stoi(year->str()));
  for (const auto& [word, year] : kPublished)
    if (names(source, word)) years.insert(year);
  if (years.empty() || is_own(source)) years.insert(kYearRead);
  return years;
}

json calibration_rows() {
  std::vector<std::pair<const gpu::Preset*, gpu::GpuConfiguration>> machines;
  for (const gpu::Preset& preset : gpu::presets()) machines.emplace_back(&preset, gpu::load_gpu(preset.name));
  std::stable_partition(machines.begin(), machines.end(),
                        [](const auto& machine) { return machine.first->name == kDefaultPreset; });
  json rows = json::array();
  for (const auto& key : gpu::gpu_keys().keys()) {
    const std::optional<double> usual = number_of(gpu::gpu_keys().default_value(key));
    if (!usual) continue;
    for (const auto& [preset, machine] : machines)
      if (preset->name == kDefaultPreset || preset->sources.contains(std::string(key.name)))
        rows.push_back(row_of(*preset, key, key.get(machine), *usual));
  }
  return rows;
}

std::string calibration_introduction() {
  std::size_t numbers = 0, published = 0, in_part = 0;
  for (const json& row : calibration_rows()) {
    if (row["preset"] != kDefaultPreset) continue;
    const auto source = row["source"].get<std::string>();
    const bool spec = names(source, "[spec]");
    ++numbers;
    published += spec && !is_own(source) ? 1 : 0;
    in_part += spec && is_own(source) ? 1 : 0;
  }
  constexpr std::string_view kText =
      "Of the {} numbers of `{}`, {} are published, {} rest on a publication in part, and {} are "
      "chosen or measured by us. They describe a class of\n"
      "machines, not one part: test a conclusion at both ends of each number on which it depends "
      "(`--sensitivity`).\n"
      "\n"
      "A number without a range is a published or a measured figure. A preset without a row has "
      "the value of `mid-mobile`. [spec] marks published\n"
      "figures, [measured] our own measurements, [assumed] our own choice. A date is the year in "
      "which the named part or publication appeared; {} is the year of\n"
      "our assumptions and measurements, and the year in which we read drivers, whose code has no "
      "date. [gpu.md](gpu.md) explains each number,\n"
      "[validation.md](validation.md) lists the differences between the model and real GPUs.";
  return fmt::format(kText, numbers, kDefaultPreset, published, in_part, numbers - published - in_part, kYearRead);
}

}  // namespace tessera::replay
