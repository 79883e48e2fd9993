#include "replay/baseline_report.h"

#include <fmt/format.h>

#include "base/atomic_file.h"

namespace tessera::replay {
namespace {

using baselines::BaselineCounters;
using baselines::SchemeId;

constexpr const auto& kFields = kCounterFields<BaselineCounters>;
constexpr int kColumn = 23;  // of the table: the longest name and a blank

// "12 345 678"
std::string grouped(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, " ");
  return text;
}

std::string ratio(std::uint64_t over, std::uint64_t under) {
  return over == 0 || under == 0 ? "-" : fmt::format("{:.2f}", static_cast<double>(over) / static_cast<double>(under));
}

std::string csv_rows(const std::string& frame, const baselines::BaselineSet& set) {
  std::string text;
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
    text += fmt::format("{},{},{}", frame, baselines::kSchemes[s].name, name(baselines::kSchemes[s].kind));
    for (const auto& field : kFields) text += fmt::format(",{}", set.schemes[s].*field.member);
    text += "\n";
  }
  return text;
}

}  // namespace

nlohmann::json baselines_json(const baselines::BaselineSet& set) {
  nlohmann::json out = nlohmann::json::object();
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    for (const auto& field : kFields)
      out[std::string(baselines::kSchemes[s].name)][std::string(field.name)] = set.schemes[s].*field.member;
  return out;
}

nlohmann::json baseline_kinds_json() {
  nlohmann::json out = nlohmann::json::object();
  for (const baselines::SchemeRow& scheme : baselines::kSchemes) out[std::string(scheme.name)] = name(scheme.kind);
  return out;
}

std::string baselines_table(const baselines::BaselineSet& set) {
  const BaselineCounters &pre = set[SchemeId::kTessera], &post = set[SchemeId::kPostTessellation];
  std::string text = fmt::format("{:<36}", "counter");
  for (const baselines::SchemeRow& scheme : baselines::kSchemes) text += fmt::format("{:>{}}", scheme.name, kColumn);
  text += fmt::format("{:>11}\n{:<36}", "post/pre", "kind");
  for (const baselines::SchemeRow& scheme : baselines::kSchemes)
    text += fmt::format("{:>{}}", name(scheme.kind), kColumn);
  text += fmt::format("{:>11}\n", "");
  for (const auto& field : kFields) {
    text += fmt::format("{:<36}", field.name);
    for (const BaselineCounters& scheme : set.schemes)
      text += fmt::format("{:>{}}", grouped(scheme.*field.member), kColumn);
    text += fmt::format("{:>11}\n", ratio(post.*field.member, pre.*field.member));
  }
  text += fmt::format("{:<36}", "tile overlaps per primitive");
  for (const BaselineCounters& scheme : set.schemes)
    text += fmt::format("{:>{}}", ratio(scheme.tile_overlaps, scheme.primitives), kColumn);
  return text + fmt::format("{:>11}\n", "");
}

void BaselineReport::add(int frame, const baselines::BaselineSet& set) {
  frames_.push_back({frame, set});
  total_.accumulate(set);
}

std::string BaselineReport::csv() const {
  std::string text = "frame,scheme,kind";
  for (const auto& field : kFields) text += fmt::format(",{}", field.name);
  text += "\n";
  for (const Frame& frame : frames_) text += csv_rows(std::to_string(frame.frame), frame.set);
  return text + csv_rows("total", total_);
}

void BaselineReport::write(const std::filesystem::path& folder) const {
  write_file_atomically(folder / "baselines.csv", csv());
}

}  // namespace tessera::replay
