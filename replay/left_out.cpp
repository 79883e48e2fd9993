#include "replay/left_out.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/option_numbers.h"
#include "base/text.h"
#include "replay/progress.h"
#include "replay/tradeoff/effect_costs.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Primitives of nodes, as DrawnFilter numbers them.
using Primitives = std::set<std::pair<int, int>>;

Primitives primitives_of(const DrawableName& part, bool by_node, const scene::Assembly& assembly,
                         const DrawableNames& names) {
  Primitives out;
  for (const scene::DrawnPrimitive& drawn : assembly.drawn) {
    const DrawableName name = names.of(drawn.first_drawable + 1);
    if (name.material != part.material || (by_node && name.node != part.node)) continue;
    const scene::Drawable& drawable = assembly.drawables[drawn.first_drawable];
    out.insert({drawable.node, drawable.primitive});
  }
  return out;
}

void sort_by_cycles(json& rows) {
  std::vector<json> sorted(rows.begin(), rows.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const json& a, const json& b) { return a.at("cycles") < b.at("cycles"); });
  rows = std::move(sorted);
}

}  // namespace

// A part of the frame, and how a device draws without it.
struct LeaveOneOut::Part {
  json names;  // "node", "material" or "effect"
  Primitives primitives{};
  const EffectCase* effect = nullptr;

  // The parts with most cycles, without the work of no part.
  static std::vector<Part> of_shares(const gpu::CostAttribution& shares, bool by_node, const Wanted& wanted,
                                     const scene::Assembly& assembly, const DrawableNames& names) {
    std::vector<Part> out;
    for (const auto& [name, share] : sum_shares(shares.drawables, names, by_node)) {
      if (wanted.only && name != *wanted.only) continue;
      Part part{{{"material", name.material}}, primitives_of(name, by_node, assembly, names)};
      if (by_node) part.names["node"] = name.node;
      if (!part.primitives.empty() && out.size() < wanted.most) out.push_back(std::move(part));
    }
    return out;
  }

  static std::vector<Part> of_effects(const gpu::FrameEffects& effects) {
    std::vector<Part> out;
    for (const EffectCase& effect : effect_cases()) {
      const auto ran = effects.find(effect.name);
      if (ran == effects.end() || !ran->second || !can_leave_out(effect.name)) continue;
      out.push_back({{{"effect", effect.name}}, {}, &effect});
    }
    return out;
  }
};

LeaveOneOut::LeaveOneOut(const scene::Capture& capture, gpu::GpuConfiguration gpu, gpu::RunSettings settings,
                         gpu::RenderRequest request, Wanted wanted, std::function<void(gpu::Device&)> prepare)
    : capture_(capture),
      gpu_(std::move(gpu)),
      settings_(std::move(settings)),
      request_(std::move(request)),
      wanted_(std::move(wanted)),
      prepare_(std::move(prepare)) {
  request_.auxiliary = request_.resolve_auxiliary = request_.error = false;
  request_.keep_transactions = request_.record_items = request_.attribute = request_.pixel_ids = false;
}

bool LeaveOneOut::can_leave_out(const std::string& effect) { return effect != "environment_image"; }

std::vector<std::pair<const char*, std::vector<LeaveOneOut::Part>>> LeaveOneOut::kinds_of(
    const MeasuredFrame& frame, const scene::Assembly& assembly, const DrawableNames& names) const {
  std::vector<std::pair<const char*, std::vector<Part>>> kinds;
  kinds.emplace_back("drawables", Part::of_shares(frame.shares, true, wanted_, assembly, names));
  if (wanted_.drawables_only || wanted_.only) return kinds;
  kinds.emplace_back("materials", Part::of_shares(frame.shares, false, wanted_, assembly, names));
  kinds.emplace_back("effects", Part::of_effects(frame.effects));
  return kinds;
}

json LeaveOneOut::takes(int frame, const Part& part, const Watch& watch) const {
  gpu::RunSettings settings = settings_;
  gpu::GpuConfiguration gpu = gpu_;
  gpu::CaptureChanges changes;
  if (part.effect == nullptr) {
    changes.drawn = [&part](int node, int primitive) { return !part.primitives.contains({node, primitive}); };
  } else {
    if (part.effect->of_scene()) changes.without_effect = part.effect->name;
    apply(part.effect->without, settings, gpu);
  }
  gpu::Device device(std::make_shared<const gpu::PreparedCapture>(capture_, changes), gpu, settings, request_);
  struct Told {
    const Watch& watch;
    ~Told() {
      if (watch.renders) watch.renders(nullptr);
    }
  } const told{watch};
  if (watch.renders) watch.renders(&device);
  prepare_(device);
  const gpu::FrameResult result = device.render(frame);
  const memory::Traffic traffic = result.counters.ledger.total();
  return {{"cycles", static_cast<std::uint64_t>(std::ceil(result.model->timing.cycles))},
          {"energy_nj", result.model->energy.total_nj()},
          {"dram_bytes", traffic.read_bytes + traffic.written_bytes}};
}

json LeaveOneOut::measure(const MeasuredFrame& frame, const scene::Assembly& assembly, const DrawableNames& names,
                          const Watch& watch) const {
  const auto kinds = kinds_of(frame, assembly, names);
  std::size_t done = 0, all = 0;
  for (const auto& [kind, parts] : kinds) all += parts.size();
  std::map<Primitives, json> known;  // a material of one drawable is rendered once
  json out;
  for (const auto& [kind, parts] : kinds) {
    out[kind] = json::array();
    for (const Part& part : parts) {
      if (watch.stop && watch.stop()) break;
      json row = part.names;
      const auto found = part.effect == nullptr ? known.find(part.primitives) : known.end();
      const json taken = found != known.end() ? found->second : takes(frame.frame, part, watch);
      if (part.effect == nullptr) known[part.primitives] = taken;
      row.update(taken);
      out[kind].push_back(std::move(row));
      sort_by_cycles(out[kind]);
      if (watch.measured) watch.measured(out, ++done, all, part.names);
    }
  }
  return out;
}

LeaveOneOut::Watch watch_on_terminal(bool quiet) {
  LeaveOneOut::Watch watch;
  watch.stop = stop_requested;
  watch.measured = [quiet, progress = std::shared_ptr<Progress>()](const json&, std::size_t done, std::size_t all,
                                                                   const json& last) mutable {
    if (!progress) progress = std::make_shared<Progress>(all, quiet);
    progress->update(done, "without " + escape_control(last.dump(), 60));
  };
  return watch;
}

std::size_t parse_left_out(const std::string& text) {
  if (text == "all") return std::numeric_limits<std::size_t>::max();
  constexpr const char* kForm = "a number from 1 on, or all";
  const long parts = parse_whole_numbers("--without", text, ',', 1, kForm)[0];
  if (parts < 1) throw UsageError(fmt::format("--without {}: expected {}", parts, kForm));
  return static_cast<std::size_t>(parts);
}

std::string left_out_table(const json& frame) {
  const double cycles = frame.at("timing").at("cycles").get<double>();
  std::string text = fmt::format("\n{:<48} {:>10} {:>14} {:>12}\n", "frame without", "attributed", "saves", "ms");
  const double ms = frame.at("timing").at("time_ms").get<double>();
  for (const auto& [kind, rows] : frame.at("without").items())
    for (const json& row : rows) {
      std::string name = row.value("effect", row.value("material", std::string())), attributed = "-";
      if (row.contains("node")) name = row.at("node").get<std::string>() + " · " + name;
      if (kind != "effects")
        for (const json& share : frame.at(kind))
          if (share.at("material") == row.at("material") && (kind != "drawables" || share.at("node") == row.at("node")))
            attributed = fmt::format("{:.1f} %", 100 * share.at("cycles").get<double>() / cycles);
      const double without = row.at("cycles").get<double>();
      text += fmt::format("{:<48} {:>10} {:>12.1f} % {:>12.3f}\n",
                          escape_control(fmt::format("{} {}", kind.substr(0, kind.size() - 1), name), 48), attributed,
                          100 * (1 - without / cycles), ms * without / cycles);
    }
  return text;
}

}  // namespace tessera::replay
