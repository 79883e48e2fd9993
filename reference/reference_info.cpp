#include "reference/reference_info.h"

#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/whole_file.h"

namespace tessera::reference {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxFileBytes = 1u << 20;  // [assumed] a thousand times a written file

json number_or_null(const std::optional<double>& number) { return number ? json(*number) : json(); }

Convergence read_convergence(const JsonValue& value) {
  Convergence out;
  const JsonValue size = value.member("size");
  const std::vector<JsonValue> sides = size.elements();
  if (sides.size() != 2) size.refuse("is not a width and a height");
  out.width = sides[0].whole();
  out.height = sides[1].whole();
  for (const JsonValue& samples : value.member("samples").elements()) out.samples.push_back(samples.whole());
  out.rms_error = value.member("rms_error").numbers();
  if (out.rms_error.size() != out.samples.size())
    value.member("rms_error").refuse("has not one error for each number of samples");
  out.slope = value.member("slope").number_or_null();
  return out;
}

}  // namespace

json reference_info_json(const ReferenceInfo& info) {
  return {{"samples", info.samples},
          {"asked_samples", info.asked_samples},
          {"enough_db", number_or_null(info.enough_db)},
          {"edge_pixels", info.edge_pixels},
          {"triangles", info.triangles},
          {"rms_error", number_or_null(info.rms_error)},
          {"psnr_db", number_or_null(info.psnr_db)},
          {"convergence",
           {{"size", {info.convergence.width, info.convergence.height}},
            {"samples", info.convergence.samples},
            {"rms_error", info.convergence.rms_error},
            {"slope", number_or_null(info.convergence.slope)}}},
          {"host",
           {{"seconds", info.host.wall_seconds},
            {"processor_seconds", info.host.processor_seconds},
            {"convergence_processor_seconds", info.host.convergence_processor_seconds}}}};
}

ReferenceInfo read_reference_info(const std::filesystem::path& file) {
  const json document = parse_json(read_whole_text(file, kMaxFileBytes), file.string());
  const JsonValue root(document, file.string());
  ReferenceInfo info;
  info.samples = root.member("samples").whole();
  info.asked_samples = root.member("asked_samples").whole();
  info.enough_db = root.member("enough_db").number_or_null();
  info.edge_pixels = root.member("edge_pixels").number();
  info.triangles = root.member("triangles").count();
  info.rms_error = root.member("rms_error").number_or_null();
  info.psnr_db = root.member("psnr_db").number_or_null();
  info.convergence = read_convergence(root.member("convergence"));
  const JsonValue host = root.member("host");
  info.host = {host.member("seconds").number(), host.member("processor_seconds").number(),
               host.member("convergence_processor_seconds").number()};
  return info;
}

}  // namespace tessera::reference
