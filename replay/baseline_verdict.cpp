#include "replay/baseline_verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"

namespace tessera::replay {
namespace {

using baselines::BaselineCounters;
using baselines::BaselineSet;
using baselines::SchemeId;
using baselines::SchemeKind;
using nlohmann::json;

// A quantity by which the verdict compares schemes; the smaller one wins.
struct Measure {
  const char* name;
  std::uint64_t BaselineCounters::*member;
  const char *same, *less, *more;
};
constexpr std::array<Measure, 3> kMeasures = {
    {{"cycles", &BaselineCounters::cycles, "time", "less time", "more time"},
     {"dram_bytes", &BaselineCounters::dram_bytes, "bytes", "fewer bytes", "more bytes"},
     {"energy_nj", &BaselineCounters::energy_nj, "energy", "less energy", "more energy"}}};

const baselines::SchemeRow& row_of(std::size_t scheme) { return baselines::kSchemes[scheme]; }

bool timed(const BaselineSet& set) { return set[SchemeId::kTessera].cycles > 0; }

double quotient(std::uint64_t over, std::uint64_t under) {
  return under == 0 ? 0.0 : static_cast<double>(over) / static_cast<double>(under);
}

// Returns the scheme of a kind with the smallest value. A scheme that does not count the measure has 0 and is left out.
std::size_t best_of(const BaselineSet& set, SchemeKind kind, const Measure& measure) {
  std::size_t best = baselines::kSchemeCount;
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
    const std::uint64_t value = set.schemes[s].*measure.member;
    if (row_of(s).kind != kind || value == 0) continue;
    if (best == baselines::kSchemeCount || value < set.schemes[best].*measure.member) best = s;
  }
  return best;
}

// "12 % less time than immediate"
std::string against_text(double part, const Measure& measure, std::string_view scheme) {
  const double percent = 100 * std::abs(part - 1);
  if (percent < 0.05) return fmt::format("the same {} as {}", measure.same, scheme);
  return fmt::format("{:.{}f} % {} than {}", percent, percent < 10 ? 1 : 0, part < 1 ? measure.less : measure.more,
                     scheme);
}

}  // namespace

json baseline_verdict_json(const BaselineSet& set) {
  json out = {{"against", json::object()}};
  std::string sentence;
  for (const auto& [kind, words] : {std::pair{SchemeKind::kShipped, "tessera against the best that ships: "},
                                    std::pair{SchemeKind::kIdealised, "Against the best idealised baseline: "}}) {
    json& best = out["against"][std::string(name(kind))] = json::object();
    std::string parts;
    for (const Measure& measure : kMeasures) {
      const std::size_t scheme = best_of(set, kind, measure);
      if (scheme == baselines::kSchemeCount || set[SchemeId::kTessera].*measure.member == 0) continue;
      const std::uint64_t value = set.schemes[scheme].*measure.member;
      const double part = quotient(set[SchemeId::kTessera].*measure.member, value);
      best[measure.name] = {{"scheme", row_of(scheme).name}, {"value", value}, {"ratio", part}};
      parts += (parts.empty() ? "" : ", ") + against_text(part, measure, row_of(scheme).name);
    }
    if (!parts.empty()) sentence += (sentence.empty() ? "" : " ") + (words + parts) + ".";
  }
  out["sentence"] = sentence;
  return out;
}

std::string baseline_verdict_text(const BaselineSet& set, double clock_mhz, double frames) {
  const Measure& order = timed(set) ? kMeasures[0] : kMeasures[1];
  std::vector<std::size_t> schemes(baselines::kSchemeCount);
  for (std::size_t s = 0; s < schemes.size(); ++s) schemes[s] = s;
  std::stable_sort(schemes.begin(), schemes.end(), [&](std::size_t a, std::size_t b) {
    return set.schemes[a].*order.member < set.schemes[b].*order.member;
  });
  const BaselineCounters& tessera = set[SchemeId::kTessera];
  std::string text = fmt::format("  {:<24} {:<10} {:>10} {:>6} {:>10} {:>6} {:>11} {:>6} {:>11}\n", "a frame of",
                                 "kind", "ms", "", "mJ", "", "traffic", "", "list memory");
  for (const std::size_t s : schemes) {
    const BaselineCounters& of = set.schemes[s];
    const auto cell = [&](std::uint64_t value, double scale) {
      return value == 0 ? std::string("-") : fmt::format("{:.3f}", static_cast<double>(value) * scale / frames);
    };
    const auto times = [&](std::uint64_t BaselineCounters::*member) {
      return of.*member == 0 || tessera.*member == 0 ? ""
                                                     : fmt::format("{:.2f}x", quotient(of.*member, tessera.*member));
    };
    text += fmt::format("{} {:<24} {:<10} {:>10} {:>6} {:>10} {:>6} {:>11} {:>6} {:>11}\n",
                        s == static_cast<std::size_t>(SchemeId::kTessera) ? ">" : " ", row_of(s).name,
                        name(row_of(s).kind), cell(of.cycles, 1e-3 / clock_mhz), times(&BaselineCounters::cycles),
                        cell(of.energy_nj, 1e-6), times(&BaselineCounters::energy_nj),
                        human_bytes(static_cast<std::uint64_t>(static_cast<double>(of.dram_bytes) / frames)),
                        times(&BaselineCounters::dram_bytes), human_bytes(of.queue_bytes_peak));
  }
  return text + baseline_verdict_json(set).at("sentence").get<std::string>() + "\n";
}

}  // namespace tessera::replay
