#include "replay/compare/run_figures.h"

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "replay/file_kind.h"
#include "replay/statistics.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A member of an object, or null: files may hold anything.
const json* member(const json* object, const char* name) {
  if (object == nullptr || !object->is_object()) return nullptr;
  const auto found = object->find(name);
  return found == object->end() ? nullptr : &*found;
}

double number(const json* value) { return value != nullptr && value->is_number() ? value->get<double>() : 0; }

std::string text(const json* value) {
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

// Keys with dots for each level.
void flatten(const json& value, const std::string& key, std::map<std::string, json>& keys) {
  if (!value.is_object()) {
    keys[key] = value;
    return;
  }
  for (const auto& [name, inner] : value.items()) flatten(inner, key.empty() ? name : key + "." + name, keys);
}

// Counters of which the peak over the frames is kept.
const std::set<std::string>& peak_counters() {
  static const std::set<std::string> kPeaks = [] {
    std::set<std::string> peaks;
    for (const json& row : describe_counters())
      if (row["over_frames"] == "peak") peaks.insert(row["name"].get<std::string>());
    return peaks;
  }();
  return kPeaks;
}

// Adds up the numbers of an object's members, or of one member of each.
void add_numbers(const json* object, const char* inner, double scale, std::map<std::string, double>& sums) {
  if (object == nullptr || !object->is_object()) return;
  for (const auto& [name, value] : object->items())
    sums[name] += scale * number(inner == nullptr ? &value : member(&value, inner));
}

void add_timing(const json* timing, double share, double clock_mhz, RunFigures& out) {
  if (timing == nullptr || !timing->is_object()) return;
  auto& summary = out.of(Section::kSummary);
  const double cycles = share * number(member(timing, "cycles"));
  summary[kCyclesRow] += cycles;
  if (clock_mhz > 0) summary[kTimeRow] += cycles / clock_mhz * 1e-3;
  if (const json* passes = member(timing, "passes"); passes != nullptr && passes->is_array() && passes->size() > 1)
    for (const json& pass : *passes)
      out.of(Section::kPasses)[text(member(&pass, "name"))] +=
          share * (number(member(&pass, "end_cycles")) - number(member(&pass, "begin_cycles")));
  add_numbers(member(timing, "units"), "busy_cycles", share, out.of(Section::kUnits));
  add_numbers(member(member(timing, "events"), "critical_path"), nullptr, share, out.of(Section::kPath));
}

void add_traffic(const json* rows, double share, RunFigures& out) {
  if (rows == nullptr || !rows->is_array()) return;
  auto &summary = out.of(Section::kSummary), &purposes = out.of(Section::kPurposes);
  for (const char* row : {kTrafficRow, "dram_read_bytes", "dram_written_bytes"}) summary[row] += 0;
  for (const json& row : *rows) {
    const double read = share * number(member(&row, "read_bytes")),
                 written = share * number(member(&row, "written_bytes"));
    summary["dram_read_bytes"] += read;
    summary["dram_written_bytes"] += written;
    summary[kTrafficRow] += read + written;
    purposes[text(member(&row, "unit")) + "." + text(member(&row, "purpose"))] += read + written;
  }
}

void add_split(const json* rows, double share, std::map<std::string, double>& sums) {
  if (rows == nullptr || !rows->is_array()) return;
  for (const json& row : *rows) {
    const std::string node = text(member(&row, "node")), material = text(member(&row, "material"));
    const std::string name = node.empty() || material.empty() ? node + material : node + " / " + material;
    sums[name.empty() ? "(of none)" : name] += share * number(member(&row, "cycles"));
  }
}

void add_counters(const json* counters, std::map<std::string, double>& sums) {
  if (counters == nullptr || !counters->is_object()) return;
  for (const auto& [name, value] : counters->items()) {
    double& sum = sums[name];
    sum = peak_counters().contains(name) ? std::max(sum, number(&value)) : sum + number(&value);
  }
}

void add_frame(const json& frame, double share, double clock_mhz, RunFigures& out) {
  add_timing(member(&frame, "timing"), share, clock_mhz, out);
  if (const json* energy = member(&frame, "energy")) {
    out.of(Section::kSummary)[kEnergyRow] += share * number(member(energy, "total_nj")) * 1e-6;
    add_numbers(member(energy, "by_unit"), nullptr, share * 1e-6, out.of(Section::kEnergy));
  }
  add_traffic(member(&frame, "dram"), share, out);
  add_split(member(&frame, "drawables"), share, out.of(Section::kDrawables));
  add_split(member(&frame, "materials"), share, out.of(Section::kMaterials));
  add_counters(member(&frame, "counters"), out.of(Section::kCounters));
}

// The unit that bounds the most cycles of the frames.
std::string max_bounding(const std::vector<const json*>& frames) {
  std::map<std::string, double> cycles;
  for (const json* frame : frames) {
    const json* timing = member(frame, "timing");
    if (const std::string by = text(member(timing, "bound_by")); !by.empty())
      cycles[by] += number(member(timing, "bound_by_cycles"));
  }
  const auto most =
      std::max_element(cycles.begin(), cycles.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == cycles.end() ? "" : most->first;
}

void check_totals(const json& root, const std::string& file) {
  if (root["schema"] == "tessera.time/1") return;
  static const json::json_pointer kCounters("/total/counters");
  if (!root.contains(kCounters) || !root[kCounters].is_object())
    throw InputError(file, kCounters.to_string(), "is not an object of counters");
}

}  // namespace

std::map<std::string, json> RunStatistics::keys() const {
  std::map<std::string, json> out;
  for (const char* part : {"gpu", "settings"})
    if (const json* object = member(&root, part)) flatten(*object, "", out);
  if (const json* capture = member(&root, "capture"); capture != nullptr && capture->is_object())
    for (const auto& [name, value] : capture->items())
      if (name != "notices") flatten(value, "capture." + name, out);
  // The first frame stands for all: its effects have a large influence.
  if (const json* effects = member(&root["frames"][0], "effects")) flatten(*effects, "effect", out);
  return out;
}

RunStatistics read_run(const fs::path& file_or_folder) {
  std::error_code ignored;
  RunStatistics run;
  run.file = file_or_folder;
  if (fs::is_directory(file_or_folder, ignored)) {
    run.file = file_or_folder / "stats.json";
    if (!fs::exists(run.file, ignored))
      throw InputError(file_or_folder.string(), "", "holds no stats.json: it is not the --out of a replay");
  }
  const std::string name = run.file.string();
  run.root = read_as(FileKind::kStatistics, run.file, [&] {
    json root = parse_json(read_whole_text(run.file), name);
    const json schema = root.is_object() ? root.value("schema", json()) : json();
    if (schema != "tessera.stats/1" && schema != "tessera.time/1")
      throw InputError(name, "/schema", "is not tessera.stats/1");
    check_totals(root, name);
    const json* frames = member(&root, "frames");
    if (frames == nullptr || !frames->is_array()) throw InputError(name, "/frames", "is not a list of frames");
    if (frames->empty()) throw InputError(name, "/frames", "is empty: the replay was stopped before its first frame");
    return root;
  });
  for (std::size_t f = 0; f < run.root["frames"].size(); ++f) {
    const json* frame = member(&run.root["frames"][f], "frame");
    if (frame == nullptr || !frame->is_number_unsigned() || frame->get<std::uint64_t>() > 1000000000)
      throw InputError(name, fmt::format("/frames/{}/frame", f), "is not the number of a frame");
    run.frames.push_back(frame->get<int>());
  }
  return run;
}

std::vector<int> common_frames(const std::vector<RunStatistics>& runs) {
  std::vector<int> common = runs.front().frames;
  for (const RunStatistics& run : runs)
    std::erase_if(common, [&](int frame) { return std::count(run.frames.begin(), run.frames.end(), frame) == 0; });
  return common;
}

const SectionInfo& info(Section section) {
  static constexpr std::array<SectionInfo, kSectionCount> kInfos = {
      {{"summary", "a frame", ""},
       {"path", "cycles of the critical path", "cycles"},
       {"passes", "cycles from begin to end of passes", "cycles"},
       {"units", "busy cycles of units", "cycles"},
       {"purposes", "bytes over the memory interface by unit and purpose", "bytes"},
       {"energy", "energy by unit, mJ", "mJ"},
       {"drawables", "cycles by drawable", "cycles"},
       {"materials", "cycles by material", "cycles"},
       {"counters", "counters of all frames", ""}}};
  return kInfos[static_cast<std::size_t>(section)];
}

std::optional<double> RunFigures::value(Section section, const std::string& name) const {
  const auto found = of(section).find(name);
  return found == of(section).end() ? std::nullopt : std::optional(found->second);
}

RunFigures figures_of(const RunStatistics& run, const std::vector<int>& frames) {
  std::vector<const json*> chosen;
  for (std::size_t f = 0; f < run.frames.size(); ++f)
    if (std::count(frames.begin(), frames.end(), run.frames[f]) > 0) chosen.push_back(&run.root["frames"][f]);
  const double clock_mhz = number(member(member(member(&run.root, "gpu"), "clock"), "mhz"));
  RunFigures out;
  for (const json* frame : chosen) add_frame(*frame, 1.0 / static_cast<double>(chosen.size()), clock_mhz, out);
  out.bound_by = max_bounding(chosen);
  return out;
}

}  // namespace tessera::replay
