#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/report/report.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Checks that every member that page/tradeoff.js reads exists and has its type: otherwise the page would stop half way.

void expect_texts(const JsonValue& object, std::initializer_list<const char*> names) {
  for (const char* name : names) object.member(name).text();
}

void expect_numbers(const JsonValue& object, std::initializer_list<const char*> names) {
  for (const char* name : names) object.member(name).number();
}

void expect_numbers_or_nulls(const JsonValue& object, std::initializer_list<const char*> names) {
  for (const char* name : names) object.member(name).number_or_null();
}

void expect_objects(const JsonValue& object, std::initializer_list<const char*> names) {
  for (const char* name : names) object.member(name).members();
}

void check_reference(const JsonValue& reference) {
  if (reference.is_null()) return;
  expect_numbers(reference, {"samples", "edge_pixels"});
  expect_numbers_or_nulls(reference, {"psnr_db"});
  const JsonValue convergence = reference.member("convergence"), errors = convergence.member("rms_error");
  expect_numbers_or_nulls(convergence, {"slope"});
  convergence.member("size").numbers();
  if (convergence.member("samples").numbers().size() != errors.numbers().size())
    errors.refuse("has not one error for each number of samples");
}

void check_setting(const JsonValue& setting, bool timed) {
  expect_texts(setting, {"label", "says", "arguments"});
  setting.member("base").flag();
  expect_numbers_or_nulls(setting, {"ms", "cycles", "dram_bytes", "energy_nj", "watched"});
  expect_objects(setting, {"front"});
  const JsonValue error = setting.member("error"), host = setting.member("host");
  if (!timed) {
    expect_numbers_or_nulls(error, {"psnr_db"});
    expect_numbers(error, {"ssim", "flip", "max_error"});
  }
  for (const char* times : {"seconds", "processor_seconds"})
    expect_numbers(host.member(times), {"median", "low", "high"});
}

void check_knob(const JsonValue& knob) {
  expect_texts(knob, {"name", "title", "context", "watched", "watched_as", "skipped"});
  knob.member("idle").flag();
  const bool timed = knob.member("timed").flag();
  for (const JsonValue& setting : knob.member("settings").elements()) check_setting(setting, timed);
}

// `settings`: how many there are; none where the tradeoff was stopped.
void check_effect(const JsonValue& effect, std::size_t settings) {
  expect_texts(effect, {"name", "reason", "without", "stays"});
  effect.member("ran").flag();
  expect_numbers(effect, {"tiles", "sub_patches"});
  for (const auto& [name, counter] : effect.member("counters").members()) counter.number();
  const JsonValue setting = effect.member("setting");
  if (!setting.is_null() && settings > 0 && setting.count() >= settings)
    setting.refuse("is not the number of a setting");
}

void check_tradeoff(const JsonValue& root) {
  if (const JsonValue schema = root.member("schema"); schema.text() != "tessera.tradeoff/1")
    schema.refuse("is not tessera.tradeoff/1");
  root.member("stopped").flag();
  expect_texts(root, {"capture"});
  root.member("size").numbers();
  expect_numbers(root, {"rounds"});
  expect_objects(root, {"settings", "gpu"});
  check_reference(root.member("reference"));
  const std::vector<JsonValue> knobs = root.member("knobs").elements();
  for (const JsonValue& knob : knobs) check_knob(knob);
  if (const auto effects = root.find("effects")) {
    const std::size_t settings = knobs.empty() ? 0 : knobs.front().member("settings").elements().size();
    for (const JsonValue& effect : effects->elements()) check_effect(effect, settings);
  }
  const auto cheapest = root.find("cheapest");
  if (!cheapest) return;
  expect_texts(*cheapest, {"cost"});
  expect_numbers_or_nulls(*cheapest, {"max_flip", "min_psnr"});
  for (const char* name : {"setting", "missed"})
    if (const JsonValue setting = cheapest->member(name); !setting.is_null())
      expect_texts(setting, {"label", "knob", "arguments"});
}

}  // namespace

// The page shows tradeoff.json and needs no other file of the folder.
json tradeoff_report(const std::filesystem::path& folder, PageViews&, std::string& note) {
  const std::filesystem::path file = folder / "tradeoff.json";
  json tradeoff = parse_json(read_whole_text(file), file.string());
  const JsonValue root(tradeoff, file.string());
  check_tradeoff(root);
  if (root.member("stopped").flag()) note = "the tradeoff was stopped before its end";
  const std::vector<JsonValue> size = root.member("size").elements();
  if (size.size() != 2) root.member("size").refuse("is not a width and a height");
  const auto effects = tradeoff.find("effects");
  const std::string title =
      fmt::format("Cost of {}: {}", effects != tradeoff.end() ? "effects" : "accuracy", root.member("capture").text());
  const std::string subtitle =
      fmt::format("Frame {}, {}x{}, {}", root.member("frame").whole(), size[0].whole(), size[1].whole(),
                  effects != tradeoff.end() ? fmt::format("{} effects", effects->size())
                                            : fmt::format("{} knobs", tradeoff["knobs"].size()));
  return {{"title", title}, {"subtitle", subtitle}, {"tradeoff", std::move(tradeoff)}};
}

}  // namespace tessera::replay
