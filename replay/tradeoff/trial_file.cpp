#include "replay/tradeoff/trial_file.h"

#include <algorithm>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/json_text.h"
#include "base/whole_file.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr std::string_view kSchema = "tessera.trial/1";
constexpr std::uint64_t kMaxFileBytes = 64u << 20;  // [assumed] a thousand times the size of a written file

json figure_json(const Figure& figure) {
  return std::visit([](auto value) { return json(value); }, figure);
}

double at_least_0(const JsonValue& value) {
  const double number = value.number();
  if (!(number >= 0)) value.refuse("is below 0");
  return number;
}

std::optional<ImageError> read_error(const JsonValue& value, bool timed) {
  if (timed) {
    if (!value.is_null()) value.refuse("is not null, and the trial draws nothing");
    return std::nullopt;
  }
  return ImageError{value.member("psnr_db").number_or_null(), value.member("ssim").number(),
                    at_least_0(value.member("flip")), at_least_0(value.member("max_error"))};
}

std::string read_sha256(const JsonValue& value) {
  const std::string& digits = value.text();
  if (digits.size() != 64 || digits.find_first_not_of("0123456789abcdef") != std::string::npos)
    value.refuse("is not 64 lower-case hexadecimal digits");
  return digits;
}

// Costs have a type of their own; of any other figure 5 is whole and 5.0 is not.
Figure read_figure(const std::string& name, const JsonValue& value) {
  if (name == "timing.cycles" || name == "dram.read_bytes" || name == "dram.written_bytes") return value.count();
  if (name == "energy.total_nj") return at_least_0(value);
  return value.is_count() ? Figure(value.count()) : Figure(value.number());
}

RoundTimes read_times(const JsonValue& value) {
  RoundTimes times;
  times.wall_seconds = value.member("seconds").numbers();
  times.processor_seconds = value.member("processor_seconds").numbers();
  for (const auto& [name, seconds] :
       {std::pair("seconds", &times.wall_seconds), std::pair("processor_seconds", &times.processor_seconds)}) {
    const JsonValue member = value.member(name);
    if (seconds->empty()) member.refuse("has no round");
    if (std::any_of(seconds->begin(), seconds->end(), [](double s) { return !(s >= 0); }))
      member.refuse("has a time below 0");
  }
  if (times.wall_seconds.size() != times.processor_seconds.size())
    value.member("processor_seconds").refuse("has not one time for each of \"seconds\"");
  return times;
}

}  // namespace

json error_json(const std::optional<ImageError>& error) {
  if (!error) return {};
  return {{"psnr_db", error->psnr_db ? json(*error->psnr_db) : json()},
          {"ssim", error->ssim},
          {"flip", error->flip},
          {"max_error", error->max_error}};
}

void write_trial(const std::filesystem::path& file, const TrialResult& trial) {
  json values = json::object();
  for (const auto& [name, figure] : trial.figures) values[name] = figure_json(figure);
  const json out = {
      {"schema", kSchema},
      {"values", values},
      {"picture", trial.image_sha256},
      {"error", error_json(trial.error)},
      {"host", {{"seconds", trial.host.wall_seconds}, {"processor_seconds", trial.host.processor_seconds}}}};
  write_file_atomically(file, json_text(out, 1) + "\n");
}

TrialResult read_trial(const std::filesystem::path& file, bool timed) {
  const json document = parse_json(read_whole_text(file, kMaxFileBytes), file.string());
  const JsonValue root(document, file.string());
  if (const JsonValue schema = root.member("schema"); schema.text() != kSchema) schema.refuse("is not tessera.trial/1");
  TrialResult trial;
  trial.error = read_error(root.member("error"), timed);
  trial.image_sha256 = read_sha256(root.member("picture"));
  for (const auto& [name, value] : root.member("values").members()) trial.figures[name] = read_figure(name, value);
  trial.host = read_times(root.member("host"));
  return trial;
}

}  // namespace tessera::replay
