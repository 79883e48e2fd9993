#include <initializer_list>
#include <string>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/report/report.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

enum class Kind { kText, kNumber, kNumberOrNull, kFlag, kObject, kArray, kNumbers };

struct Member {
  const char* name;
  Kind kind;
};

bool is(const json& value, Kind kind) {
  switch (kind) {
    case Kind::kText:
      return value.is_string();
    case Kind::kNumber:
      return value.is_number();
    case Kind::kNumberOrNull:
      return value.is_number() || value.is_null();
    case Kind::kFlag:
      return value.is_boolean();
    case Kind::kObject:
      return value.is_object();
    case Kind::kArray:
      return value.is_array();
    case Kind::kNumbers:
      break;
  }
  if (!value.is_array()) return false;
  for (const json& number : value)
    if (!number.is_number()) return false;
  return true;
}

const char* in_words(Kind kind) {
  static constexpr const char* kWords[] = {"a text",    "a number", "a number or null",   "true or false",
                                           "an object", "an array", "an array of numbers"};
  return kWords[static_cast<std::size_t>(kind)];
}

// Everything that page/tradeoff.js reads must be there: without it the page would stop half way.
class Checker {
 public:
  explicit Checker(std::string file) : file_(std::move(file)) {}

  void check(const json& root) const {
    expect(root, "",
           {{"schema", Kind::kText},
            {"stopped", Kind::kFlag},
            {"capture", Kind::kText},
            {"size", Kind::kNumbers},
            {"rounds", Kind::kNumber},
            {"settings", Kind::kObject},
            {"gpu", Kind::kObject},
            {"reference", Kind::kObject},
            {"knobs", Kind::kArray}});
    if (root["schema"] != "tessera.tradeoff/1") throw InputError(file_, "/schema", "is not tessera.tradeoff/1");
    check_reference(root["reference"]);
    for (std::size_t k = 0; k < root["knobs"].size(); ++k) check_knob(root["knobs"][k], fmt::format("/knobs/{}", k));
    if (!root.contains("cheapest")) return;
    const json& cheapest = root["cheapest"];
    expect(cheapest, "/cheapest",
           {{"cost", Kind::kText}, {"max_flip", Kind::kNumberOrNull}, {"min_psnr", Kind::kNumberOrNull}});
    if (!cheapest.at("setting").is_null())
      expect(cheapest["setting"], "/cheapest/setting",
             {{"label", Kind::kText}, {"knob", Kind::kText}, {"arguments", Kind::kText}});
  }

 private:
  void expect(const json& object, const std::string& place, std::initializer_list<Member> members) const {
    if (!object.is_object()) throw InputError(file_, place, "is not an object");
    for (const Member& member : members) {
      const auto found = object.find(member.name);
      if (found == object.end()) throw InputError(file_, fmt::format("{}/{}", place, member.name), "is missing");
      if (!is(*found, member.kind))
        throw InputError(file_, fmt::format("{}/{}", place, member.name),
                         fmt::format("is not {}", in_words(member.kind)));
    }
  }

  void check_reference(const json& reference) const {
    expect(reference, "/reference",
           {{"samples", Kind::kNumber},
            {"edge_pixels", Kind::kNumber},
            {"psnr_db", Kind::kNumberOrNull},
            {"convergence", Kind::kObject}});
    const json& convergence = reference["convergence"];
    expect(convergence, "/reference/convergence",
           {{"samples", Kind::kNumbers},
            {"rms_error", Kind::kNumbers},
            {"slope", Kind::kNumberOrNull},
            {"size", Kind::kNumbers}});
    if (convergence["samples"].size() != convergence["rms_error"].size())
      throw InputError(file_, "/reference/convergence/rms_error", "has not one error for each number of samples");
  }

  void check_knob(const json& knob, const std::string& place) const {
    expect(knob, place,
           {{"name", Kind::kText},
            {"title", Kind::kText},
            {"context", Kind::kText},
            {"watched", Kind::kText},
            {"watched_as", Kind::kText},
            {"skipped", Kind::kText},
            {"idle", Kind::kFlag},
            {"settings", Kind::kArray}});
    for (std::size_t s = 0; s < knob["settings"].size(); ++s)
      check_setting(knob["settings"][s], fmt::format("{}/settings/{}", place, s));
  }

  void check_setting(const json& row, const std::string& place) const {
    expect(row, place,
           {{"label", Kind::kText},
            {"says", Kind::kText},
            {"arguments", Kind::kText},
            {"base", Kind::kFlag},
            {"cycles", Kind::kNumberOrNull},
            {"dram_bytes", Kind::kNumberOrNull},
            {"energy_nj", Kind::kNumberOrNull},
            {"watched", Kind::kNumberOrNull},
            {"error", Kind::kObject},
            {"front", Kind::kObject},
            {"host", Kind::kObject}});
    expect(row["error"], place + "/error",
           {{"psnr_db", Kind::kNumberOrNull},
            {"ssim", Kind::kNumber},
            {"flip", Kind::kNumber},
            {"max_error", Kind::kNumber}});
    expect(row["host"], place + "/host", {{"seconds", Kind::kObject}, {"processor_seconds", Kind::kObject}});
    for (const char* time : {"seconds", "processor_seconds"})
      expect(row["host"][time], fmt::format("{}/host/{}", place, time),
             {{"median", Kind::kNumber}, {"low", Kind::kNumber}, {"high", Kind::kNumber}});
  }

  std::string file_;
};

}  // namespace

// tradeoff.json is what the page shows; the page needs nothing else of the folder.
json tradeoff_report(const std::filesystem::path& folder, std::string& note) {
  const std::filesystem::path file = folder / "tradeoff.json";
  json tradeoff = parse_json(read_whole_text(file), file.string());
  Checker(file.string()).check(tradeoff);
  if (tradeoff["stopped"].get<bool>()) note = "the tradeoff was stopped before its end";
  const std::string capture = tradeoff["capture"];
  const int frame = whole_number(tradeoff.at("frame")), width = whole_number(tradeoff["size"].at(0)),
            height = whole_number(tradeoff["size"].at(1));
  return {{"title", fmt::format("What accuracy costs: {}", capture)},
          {"subtitle", fmt::format("Frame {}, {}x{}, {} knobs", frame, width, height, tradeoff["knobs"].size())},
          {"tradeoff", std::move(tradeoff)}};
}

}  // namespace tessera::replay
