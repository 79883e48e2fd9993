#include "replay/compare/causes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/text.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Number of shown parts of a level; the others are one line.
constexpr std::size_t kPartsShown = 4;
// Least relative change of a quantity of the scene that counts as a change.
constexpr double kLeastChange = 0.01;

std::string signed_count(double value) {
  const double size = std::abs(value);
  const char* sign = value < 0 ? "-" : "+";
  if (size >= 1e6) return fmt::format("{}{:.2f} M", sign, size * 1e-6);
  if (size >= 1e4) return fmt::format("{}{:.1f} k", sign, size * 1e-3);
  return fmt::format("{}{:.0f}", sign, size);
}

std::string signed_bytes(double value) {
  return fmt::format("{}{}", value < 0 ? "-" : "+", human_bytes(static_cast<std::uint64_t>(std::abs(value))));
}

// ---- What changed -------------------------------------------------------------------------------------------------

// Means over the compared frames.
class SceneFacts {
 public:
  SceneFacts(const RunStatistics& run, const std::vector<int>& frames) {
    if (const auto capture = run.root.find("capture"); capture != run.root.end() && capture->is_object())
      for (const char* count : {"lights", "textures"})
        if (capture->contains(count)) capture_[count] = number(*capture, count);
    for (const json& frame : run.root.at("frames")) {
      if (std::count(frames.begin(), frames.end(), frame.value("frame", -1)) == 0) continue;
      ++frames_;
      add(frame, "counters", counters_);
      if (const auto places = frame.find("effect_places"); places != frame.end() && places->is_object())
        for (const auto& [effect, place] : places->items())
          if (place.is_object()) effects_[effect] += number(place, "sub_patches");
      if (const auto ran = frame.find("effects"); ran != frame.end() && ran->is_object())
        for (const auto& [effect, on] : ran->items())
          if (on.is_boolean() && on.get<bool>()) ++ran_[effect];
      image_hits_ += image_hits(frame);
      passes_ += 1;
      if (const auto passes = json::json_pointer("/timing/passes"); frame.contains(passes))
        passes_ += static_cast<double>(std::max<std::size_t>(1, frame.at(passes).size())) - 1;
      if (const auto units = json::json_pointer("/timing/units/shader/busy_cycles"); frame.contains(units))
        shader_cycles_ += frame.at(units).is_number() ? frame.at(units).get<double>() : 0;
      if (const auto rows = frame.find("drawables"); rows != frame.end() && rows->is_array())
        for (const json& row : *rows)
          if (row.is_object() && !(row.value("node", "") + row.value("material", "")).empty())
            drawables_[fmt::format("{} / {}", row.value("node", ""), row.value("material", ""))] +=
                number(row, "cycles");
    }
  }

  double counter(const std::string& name) const { return mean(counters_, name); }
  // Lights or textures of the capture; nothing where the file does not count them.
  std::optional<double> count_of(const std::string& what) const {
    const auto at = capture_.find(what);
    return at == capture_.end() ? std::nullopt : std::optional(at->second);
  }
  double passes() const { return frames_ == 0 ? 0 : passes_ / static_cast<double>(frames_); }
  // Hits of triangles for each sample that sees a surface. Passes that make no image, such as shadow maps, do not
  // count.
  double layers() const {
    const double seen = counter("tilecore.samples_visible");
    return seen > 0 && frames_ > 0 ? image_hits_ / static_cast<double>(frames_) / seen : 0;
  }
  // The share of sub-patches that need an effect.
  double share(const std::string& effect) const {
    const double all = counter("frontend.sub_patches");
    return all > 0 ? mean(effects_, effect) / all : 0;
  }
  bool ran(const std::string& effect) const { return ran_.contains(effect); }
  std::set<std::string> effect_names() const {
    std::set<std::string> names;
    for (const auto& [effect, sub_patches] : effects_) names.insert(effect);
    for (const auto& [effect, frames] : ran_) names.insert(effect);
    return names;
  }
  const std::map<std::string, double>& drawables() const { return drawables_; }
  double cycles_of(const std::string& drawable) const { return mean(drawables_, drawable); }
  // The share of the image's samples that see a surface.
  double coverage() const {
    const double seen = counter("tilecore.samples_visible"), behind = counter("tilecore.background_samples");
    return seen + behind > 0 ? seen / (seen + behind) : 0;
  }
  double shader_cycles_per_invocation() const {
    const double invocations = counter("tilecore.pixel_shader_invocations");
    return invocations > 0 ? shader_cycles_ / static_cast<double>(frames_) / invocations : 0;
  }

 private:
  using Sums = std::map<std::string, double>;

  static double number(const json& object, const char* member) {
    const auto at = object.find(member);
    return at != object.end() && at->is_number() ? at->get<double>() : 0;
  }
  static double image_hits(const json& frame) {
    double hits = 0;
    bool by_pass = false;
    if (const auto passes = frame.find("passes"); passes != frame.end() && passes->is_array())
      for (const json& pass : *passes) {
        if (!pass.is_object() || !pass.contains("counters") || !pass.at("counters").is_object()) continue;
        by_pass = true;
        if (number(pass.at("counters"), "tilecore.samples_visible") > 0)
          hits += number(pass.at("counters"), "tilecore.sample_hits");
      }
    if (by_pass || !frame.contains("counters") || !frame.at("counters").is_object()) return hits;
    return number(frame.at("counters"), "tilecore.sample_hits");
  }
  static void add(const json& frame, const char* member, Sums& sums) {
    if (const auto at = frame.find(member); at != frame.end() && at->is_object())
      for (const auto& [name, value] : at->items())
        if (value.is_number()) sums[name] += value.get<double>();
  }
  double mean(const Sums& sums, const std::string& name) const {
    const auto at = sums.find(name);
    return at == sums.end() || frames_ == 0 ? 0 : at->second / static_cast<double>(frames_);
  }

  std::size_t frames_ = 0;
  Sums counters_, effects_, drawables_, capture_;
  std::map<std::string, int> ran_;
  double shader_cycles_ = 0, passes_ = 0, image_hits_ = 0;
};

// Changes with their weights; the heaviest is named first.
using Weighted = std::vector<std::pair<double, std::string>>;

// Puts a drawable or an effect that appears or disappears before any quantity that grows or shrinks.
constexpr double kCameOrWent = 100;

void add_ratio(const std::string& what, double a, double b, const char* format, Weighted& changes) {
  if (a <= 0 || b <= 0 || std::abs(b / a - 1) < kLeastChange) return;
  changes.emplace_back(
      std::abs(std::log(b / a)),
      fmt::format("{}: {} -> {}", what, fmt::format(fmt::runtime(format), a), fmt::format(fmt::runtime(format), b)));
}

// As add_ratio(), also where one of the figures is 0.
void add_figure(const std::string& what, double a, double b, const char* format, Weighted& changes) {
  if (a > 0 && b > 0) return add_ratio(what, a, b, format, changes);
  if (a <= 0 && b <= 0) return;
  changes.emplace_back(kCameOrWent, b > 0 ? fmt::format("{}: none -> {}", what, fmt::format(fmt::runtime(format), b))
                                          : fmt::format("{}: {} -> none", what, fmt::format(fmt::runtime(format), a)));
}

void add_count(const std::string& what, const SceneFacts& a, const SceneFacts& b, Weighted& changes) {
  if (a.count_of(what) && b.count_of(what)) add_figure(what, *a.count_of(what), *b.count_of(what), "{:.0f}", changes);
}

void add_drawables(const SceneFacts& a, const SceneFacts& b, Weighted& changes) {
  double all = 1;
  for (const SceneFacts* of : {&a, &b})
    for (const auto& [name, cycles] : of->drawables()) all += cycles;
  for (const auto& [name, cycles] : b.drawables())
    if (!a.drawables().contains(name))
      changes.emplace_back(
          2 * kCameOrWent + b.cycles_of(name) / all,
          fmt::format("{} is drawn, {} cycles", escape_control(name, 60), signed_count(b.cycles_of(name))));
  for (const auto& [name, cycles] : a.drawables())
    if (!b.drawables().contains(name))
      changes.emplace_back(
          2 * kCameOrWent + a.cycles_of(name) / all,
          fmt::format("{} is not drawn, {} cycles", escape_control(name, 60), signed_count(-a.cycles_of(name))));
}

void add_effects(const SceneFacts& a, const SceneFacts& b, Weighted& changes) {
  std::set<std::string> names;
  for (const SceneFacts* of : {&a, &b}) names.merge(of->effect_names());
  for (const std::string& effect : names) {
    const double before = a.share(effect), after = b.share(effect);
    const bool on_before = a.ran(effect) || before > 0, on_after = b.ran(effect) || after > 0;
    if (on_before != on_after)
      changes.emplace_back(
          kCameOrWent + std::max(before, after),
          on_after ? effect + (after > 0 ? fmt::format(" runs, for {:.0f} % of the sub-patches", 100 * after) : " runs")
                   : fmt::format("{} does not run", effect));
    else
      add_ratio(effect + ", share of the sub-patches", 100 * before, 100 * after, "{:.1f} %", changes);
  }
}

bool another_capture(const Comparison& c, std::size_t run) {
  const auto a = c.runs[0].keys(), b = c.runs[run].keys();
  const auto file = [](const auto& keys) {
    const auto at = keys.find("capture.file");
    return at == keys.end() ? json() : at->second;
  };
  return file(a) != file(b);
}

// The figures that distinguish two captures: how much is drawn, seen and shaded. The captures share no drawables, so
// names of drawables say nothing. The figures are in the order of the work: geometry, image, shading, passes.
std::vector<Cause> capture_changes(const SceneFacts& a, const SceneFacts& b) {
  Weighted figures;
  const auto counter = [&](const char* what, const char* name) {
    add_figure(what, a.counter(name), b.counter(name), "{:.0f}", figures);
  };
  add_figure("drawables", static_cast<double>(a.drawables().size()), static_cast<double>(b.drawables().size()),
             "{:.0f}", figures);
  counter("base patches", "frontend.base_patches");
  counter("sub-patches", "frontend.sub_patches");
  counter("triangles", "tilecore.triangles");
  add_figure("surfaces cover", 100 * a.coverage(), 100 * b.coverage(), "{:.1f} %", figures);
  add_figure("layers of a sample that sees a surface", a.layers(), b.layers(), "{:.2f}", figures);
  counter("blended layers", "tilecore.blended_layers");
  counter("pixel-shader invocations", "tilecore.pixel_shader_invocations");
  add_figure("shader cycles of an invocation", a.shader_cycles_per_invocation(), b.shader_cycles_per_invocation(),
             "{:.3g}", figures);
  add_count("lights", a, b, figures);
  add_count("textures", a, b, figures);
  counter("texels fetched", "texture.texels");
  add_figure("passes", a.passes(), b.passes(), "{:.0f}", figures);
  counter("texels of shadow maps", "shadows.texels_stored");
  Weighted effects;
  add_effects(a, b, effects);
  std::vector<std::string> runs, stops;
  for (const auto& [weight, text] : effects) {
    if (weight < kCameOrWent) continue;
    if (const std::size_t at = text.find(" runs"); at != std::string::npos)
      runs.push_back(text.substr(0, at));
    else
      stops.push_back(text.substr(0, text.find(" does not run")));
  }
  std::vector<Cause> parts;
  for (auto& [weight, text] : figures) parts.push_back({std::move(text), {}});
  if (!runs.empty()) parts.push_back({fmt::format("effects that A does not run: {}", fmt::join(runs, ", ")), {}});
  if (!stops.empty()) parts.push_back({fmt::format("effects that only A runs: {}", fmt::join(stops, ", ")), {}});
  return parts;
}

std::vector<Cause> scene_changes(const Comparison& c, std::size_t run, bool same_keys) {
  const SceneFacts a(c.runs[0], c.frames_of[0]), b(c.runs[run], c.frames_of[run]);
  if (another_capture(c, run)) return capture_changes(a, b);
  Weighted changes;
  add_drawables(a, b, changes);
  add_effects(a, b, changes);
  add_ratio("base patches", a.counter("frontend.base_patches"), b.counter("frontend.base_patches"), "{:.0f}", changes);
  add_ratio("surfaces cover", 100 * a.coverage(), 100 * b.coverage(), "{:.1f} %", changes);
  add_ratio("blended layers", a.counter("tilecore.blended_layers"), b.counter("tilecore.blended_layers"), "{:.0f}",
            changes);
  add_count("lights", a, b, changes);
  add_ratio("texels of shadow maps", a.counter("shadows.texels_stored"), b.counter("shadows.texels_stored"), "{:.0f}",
            changes);
  // These quantities follow from others, so the list names them only when it is empty otherwise.
  if (changes.empty() && same_keys) {
    add_ratio("sub-patches", a.counter("frontend.sub_patches"), b.counter("frontend.sub_patches"), "{:.0f}", changes);
    add_ratio("pixel-shader invocations", a.counter("tilecore.pixel_shader_invocations"),
              b.counter("tilecore.pixel_shader_invocations"), "{:.0f}", changes);
    add_ratio("shader cycles of an invocation", a.shader_cycles_per_invocation(), b.shader_cycles_per_invocation(),
              "{:.3g}", changes);
  }
  std::stable_sort(changes.begin(), changes.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
  std::vector<Cause> parts;
  for (auto& [weight, text] : changes) parts.push_back({std::move(text), {}});
  return parts;
}

std::string value_text(const std::map<std::string, json>& keys, const std::string& name) {
  const auto at = keys.find(name);
  if (at == keys.end() || at->second.is_null()) return "-";
  return at->second.is_string() ? escape_control(at->second.get<std::string>(), 40) : at->second.dump();
}

// Lists one change for the size of the image, one for another preset, and otherwise one for each key that differs.
std::vector<Cause> key_changes(const Comparison& c, std::size_t run) {
  const std::map<std::string, json> a = c.runs[0].keys(), b = c.runs[run].keys();
  const auto change = [&](const std::string& name) {
    return fmt::format("{} -> {}", value_text(a, name), value_text(b, name));
  };
  std::vector<Cause> parts, machine;
  std::set<std::string> names;
  for (const auto* keys : {&a, &b})
    for (const auto& [name, value] : *keys) names.insert(name);
  bool preset = false, size = false;
  for (const std::string& name : names) {
    const auto in_a = a.find(name), in_b = b.find(name);
    if (in_a != a.end() && in_b != b.end() && in_a->second == in_b->second) continue;
    if (name.starts_with("effect.") || name == "capture.bytes" || name == "capture.lights" ||
        name == "capture.textures")
      continue;
    preset = preset || name == "preset";
    if (name == "width" || name == "height" || name == "region")
      size = true;
    else if (name == "capture.file")
      parts.insert(parts.begin(), {"another capture: " + change(name), {}});
    else
      machine.push_back({fmt::format("{} {}", escape_control(name, 60), change(name)), {}});
  }
  if (size)
    parts.push_back({fmt::format("size of the image: {}x{} -> {}x{}", value_text(a, "width"), value_text(a, "height"),
                                 value_text(b, "width"), value_text(b, "height")),
                     {}});
  if (!preset) {
    parts.insert(parts.end(), machine.begin(), machine.end());
    return parts;
  }
  parts.push_back({fmt::format("another machine: {}, {} keys", change("preset"), machine.size() - 1), {}});
  return parts;
}

void keep_first(std::size_t count, std::vector<Cause>& parts) {
  if (parts.size() <= count) return;
  const std::size_t more = parts.size() - count;
  parts.resize(count);
  parts.push_back({fmt::format("and {} more", more), {}});
}

Cause what_changed(const Comparison& c, std::size_t run) {
  constexpr std::size_t kKeys = 6;
  Cause cause{"what changed", key_changes(c, run)};
  const bool same_keys = cause.parts.empty();
  keep_first(kKeys, cause.parts);
  // The scene's changes come last: where settings differ, they follow from the settings.
  std::vector<Cause> scene = scene_changes(c, run, same_keys);
  if (!another_capture(c, run)) keep_first(kPartsShown, scene);
  cause.parts.insert(cause.parts.end(), scene.begin(), scene.end());
  if (cause.parts.empty()) cause.parts.push_back({"nothing: same capture, machine, settings and work", {}});
  return cause;
}

// ---- Where it went ------------------------------------------------------------------------------------------------

// Lists the rows of a section that changed most and one line for all others, which add up to `all`. Without `all` rows
// overlap, and there is no such line.
Cause level(const Comparison& c, std::size_t run, Section section, const std::string& title, std::optional<double> all,
            std::string (*text)(double)) {
  std::vector<std::pair<std::string, double>> changes;
  double listed = 0;
  for (const std::string& name : c.rows(section)) {
    const double change = c.figures[run].value_or_0(section, name) - c.figures[0].value_or_0(section, name);
    if (change != 0) changes.emplace_back(name, change);
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
  Cause cause{title, {}};
  for (std::size_t k = 0; k < std::min(kPartsShown, changes.size()); ++k) {
    listed += changes[k].second;
    cause.parts.push_back({fmt::format("{} {}", escape_control(changes[k].first, 60), text(changes[k].second)), {}});
  }
  if (const double rest = all.value_or(listed) - listed; !cause.parts.empty() && std::abs(rest) >= 0.5)
    cause.parts.push_back({fmt::format("all others {}", text(rest)), {}});
  return cause;
}

// States how much more or less time the run takes; all pages and commands use this form.
std::string time_text(const Comparison& c, std::size_t run) {
  const auto figure = [&](std::size_t r, const char* name) { return c.figures[r].value(Section::kSummary, name); };
  const auto time_a = figure(0, kTimeRow), time_b = figure(run, kTimeRow);
  const auto cycles_a = figure(0, kCyclesRow), cycles_b = figure(run, kCyclesRow);
  if (!cycles_a || !cycles_b) return fmt::format("{} and A have no times", c.labels[run]);
  const bool timed = time_a && time_b;
  const double before = timed ? *time_a : *cycles_a, after = timed ? *time_b : *cycles_b;
  std::string text = before == after ? fmt::format("{} takes as long as A", c.labels[run])
                     : before == 0   ? fmt::format("{} takes time, A none", c.labels[run])
                                     : fmt::format("{} takes {:.1f} % {} time than A", c.labels[run],
                                                   100 * std::abs(after / before - 1), after > before ? "more" : "less");
  if (timed) text += fmt::format(": {:.4g} ms a frame against {:.4g}", after, before);
  return text +
         fmt::format(", {:.0f} cycles against {:.0f} ({})", *cycles_b, *cycles_a, signed_count(*cycles_b - *cycles_a));
}

std::string bound_text(const Comparison& c, std::size_t run) {
  const std::string &a = c.figures[0].bound_by, &b = c.figures[run].bound_by;
  if (a.empty() || b.empty()) return "";
  return a == b ? fmt::format("both are bound by {}", a)
                : fmt::format("{} is bound by {}, A by {}", c.labels[run], b, a);
}

}  // namespace

Cause causes_of(const Comparison& c, std::size_t run) {
  Cause root{time_text(c, run), {what_changed(c, run)}};
  const auto change = [&](const char* name) {
    return c.figures[run].value_or_0(Section::kSummary, name) - c.figures[0].value_or_0(Section::kSummary, name);
  };
  const auto add = [&](Cause cause) {
    if (!cause.parts.empty()) root.parts.push_back(std::move(cause));
  };
  add(level(c, run, Section::kDrawables, "cycles by drawable", change(kCyclesRow), signed_count));
  const bool path = !c.figures[0].of(Section::kPath).empty() && !c.figures[run].of(Section::kPath).empty();
  if (path)
    add(level(c, run, Section::kPath, "cycles by unit, on the critical path", change(kCyclesRow), signed_count));
  add(level(c, run, Section::kPasses, "cycles by pass", std::nullopt, signed_count));
  if (!path) add(level(c, run, Section::kUnits, "busy cycles of units", std::nullopt, signed_count));
  add(level(c, run, Section::kPurposes, "bytes", change(kTrafficRow), signed_bytes));
  if (const std::string bound = bound_text(c, run); !bound.empty()) root.parts.push_back({bound, {}});
  return root;
}

json cause_json(const Cause& cause) {
  json out = {{"text", cause.text}};
  for (const Cause& part : cause.parts) out["parts"].push_back(cause_json(part));
  return out;
}

std::string cause_text(const Cause& cause, std::size_t depth) {
  std::string text = fmt::format("{:{}}{}\n", "", 2 * depth, cause.text);
  for (const Cause& part : cause.parts) text += cause_text(part, depth + 1);
  return text;
}

}  // namespace tessera::replay
