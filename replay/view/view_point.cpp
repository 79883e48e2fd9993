#include "replay/view/view_point.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/key_table.h"
#include "base/option_numbers.h"
#include "base/text.h"
#include "gpu/record_file.h"
#include "gpu/shading_paths.h"
#include "gpu/taa.h"
#include "gpu/tile_memory.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using Changes = std::vector<std::pair<std::string, json>>;

constexpr int kMaxFrame = 100'000'000;

// The value of a key; nothing for a key that stands for another one (gpu::set_gpu_key()).
std::optional<json> value_of(const std::string& key, const gpu::RunSettings& settings,
                             const gpu::GpuConfiguration& gpu) {
  if (const auto* row = gpu::settings_keys().find(key)) return key_value_json(row->get(settings));
  if (const auto* row = gpu::gpu_keys().find(key)) return key_value_json(row->get(gpu));
  return std::nullopt;
}

int frame_of(const json& value) {
  if (!value.is_number_integer() || value < 0 || value > kMaxFrame)
    throw UsageError(fmt::format("frame: expected a whole number from 0, found {}", escape_control(value.dump(), 40)));
  return value.get<int>();
}

template <class S>
void add_rows(json& rows, const KeyTable<S>& table, const S& start) {
  for (const Key<S>& key : table.keys()) {
    json row = describe_key(key, table.default_value(key));
    row["start"] = key_value_json(key.get(start));
    row["timing"] = key.timing;
    rows.push_back(std::move(row));
  }
}

}  // namespace

std::string shell_word(const std::string& text) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_./:=,+-@%").find(c) != std::string_view::npos;
  };
  return !text.empty() && std::all_of(text.begin(), text.end(), plain) ? text : shell_quoted(text);
}

int ViewPoint::first_frame(int warmup) const { return accumulates ? std::max(0, frame - warmup) : frame; }

ViewSpace::ViewSpace(ViewStart start) : start_(std::move(start)), gpu_(gpu::load_gpu(start_.gpu)) {
  for (const std::string& text : start_.sets) gpu::apply_setting(text, settings_, gpu_);
  settings_ = gpu::follow_passes(*start_.capture, settings_);
  const scene::CaptureSettings& capture = start_.capture->settings;
  first_ = start_.frame.value_or(capture.first_frame);
  request_.width = capture.width;
  request_.height = capture.height;
  if (!start_.size.empty()) {
    const ImageSize size = parse_size("--size", start_.size);
    request_.width = size.width;
    request_.height = size.height;
  }
  request_.region = {0, 0, request_.width, request_.height};
  request_.record_items = true;  // so that a frame can be timed by events, too
  request_.attribute = request_.pixel_ids = true;
  static_cast<void>(start_point());
}

ViewPoint ViewSpace::point(Changes changes, int frame) const {
  ViewPoint out;
  out.frame = frame;
  out.settings = settings_;
  out.gpu = gpu_;
  out.request = request_;
  for (const auto& [key, value] : changes) gpu::set_key(key, value, out.settings, out.gpu);
  if (!out.settings.output.machine_model)
    throw UsageError("output.machine_model=false leaves nothing to view but the image; leave it true");
  gpu::check_gpu(out.gpu);
  tilecore::check_resolve(out.settings.resolve);
  for (auto& [key, value] : changes)
    if (const std::optional<json> now = value_of(key, out.settings, out.gpu))
      value = *now == *value_of(key, settings_, gpu_) ? json() : *now;
  std::erase_if(changes, [](const auto& change) { return change.second.is_null(); });
  const auto is_memory = [](const auto& change) { return change.first == "tilecore.memory_bytes"; };
  out.notice = gpu::fit_tile_memory(
      out.gpu, out.settings,
      sets_key(start_.sets, "tilecore.memory_bytes") || std::any_of(changes.begin(), changes.end(), is_memory));
  out.changes = std::move(changes);
  out.function = gpu::functional_json(out.gpu, out.settings);
  out.accumulates = out.settings.resolve.desampling == tilecore::Desampling::kAdaptive ||
                    gpu::antialiases(*start_.capture, out.settings);
  return out;
}

ViewPoint ViewSpace::changed(const ViewPoint& from, const json& changes) const {
  if (!changes.is_object()) throw UsageError("expected an object of keys and values");
  Changes all = from.changes;
  int frame = from.frame;
  for (const auto& [name, value] : changes.items()) {
    const std::string& key = name;
    if (key == "frame") {
      frame = value.is_null() ? first_ : frame_of(value);
      continue;
    }
    const bool was_changed = std::erase_if(all, [&](const auto& change) { return change.first == key; }) > 0;
    const std::vector<std::string>& known = gpu::known_keys();
    if (!value.is_null())
      all.emplace_back(key, value);
    else if (!was_changed && std::find(known.begin(), known.end(), key) == known.end())
      throw UsageError(unknown_key_message(key, known));
  }
  return point(std::move(all), frame);
}

json ViewSpace::changes_json(const ViewPoint& point) {
  json out = json::object();
  for (const auto& [key, value] : point.changes) out[key] = value;
  return out;
}

std::string ViewSpace::command_without_frames(const ViewPoint& point) const {
  std::string text = "tessera replay " + shell_word(start_.file);
  if (!start_.size.empty()) text += " --size " + shell_word(start_.size);
  if (start_.variant) text += " --variant " + shell_word(*start_.variant);
  text += view_arguments(start_.look);
  if (point.first_frame(start_.warmup) < point.frame) text += fmt::format(" --warmup {}", start_.warmup);
  if (start_.gpu != ViewStart().gpu) text += " --gpu " + shell_word(start_.gpu);
  for (const std::string& set : start_.sets)
    if (std::none_of(point.changes.begin(), point.changes.end(),
                     [&](const auto& change) { return set.starts_with(change.first + "="); }))
      text += " --set " + shell_word(set);
  for (const auto& [key, value] : point.changes) text += " --set " + shell_word(key + "=" + value_text(value));
  return text;
}

std::string ViewSpace::command(const ViewPoint& point) const {
  return fmt::format("{} --frames {}:{}", command_without_frames(point), point.frame, point.frame + 1);
}

json ViewSpace::keys() const {
  json rows = json::array();
  add_rows(rows, gpu::settings_keys(), settings_);
  add_rows(rows, gpu::gpu_keys(), gpu_);
  return rows;
}

}  // namespace tessera::replay
