#include "scene/gltf/builders.h"

#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/radiance_codec.h"
#include "base/text.h"
#include "shaders_cpp/environment_image.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;
using Kind = shaders::Surroundings::Kind;

// "sky.hdr: ", for messages; nothing for bytes inside.
std::string file_of(const json& environment) {
  if (!environment.contains("image") || is_data_uri(environment["image"].get_ref<const std::string&>())) return "";
  return escape_control(environment["image"].get_ref<const std::string&>(), 120) + ": ";
}

Image read_equirectangular(Document& document, const json& environment, const Place& place) {
  const bool view = environment.contains("bufferView");
  const Bytes bytes = view ? document.resources.buffer_view(environment["bufferView"].get<std::size_t>())
                           : document.resources.file(environment["image"].get_ref<const std::string&>(), place);
  const std::string file = file_of(environment);
  Image image;
  std::string fault;
  try {
    const auto charge = [&](std::uint64_t count) { document.budget.charge(count, 1, place); };
    if (!decode_radiance(bytes, document.limits.image, image, fault, charge)) place.refuse("{}{}", file, fault);
  } catch (const BudgetError&) {
    throw;
  } catch (const LimitError& error) {
    throw LimitError(fmt::format("{}: {}: {}{}", place.file(), place.pointer(), file, error.what()));
  }
  if (image.width != 2 * image.height)
    place.refuse("{}has {}x{} pixels: an equirectangular image is twice as wide as high", file, image.width,
                 image.height);
  return image;
}

}  // namespace

json environment_settings(const json& document) {
  const json* settings = find_extension(document, "TESSERA_capture");
  if (settings == nullptr || !settings->contains("environment")) return json::object();
  const json& environment = (*settings)["environment"];
  if (environment.is_number()) return {{"intensity", environment}};
  if (!environment.is_string()) return environment;
  if (environment == "uniform") return {{"uniform", true}};
  return {{"image", environment}};
}

void build_environment(Document& document, Capture& capture) {
  const json environment = environment_settings(document.json);
  CaptureSettings& settings = capture.settings;
  const bool image = environment.contains("image") || environment.contains("bufferView");
  settings.environment_kind = image                                 ? Kind::kImage
                              : environment.value("uniform", false) ? Kind::kUniform
                                                                    : Kind::kStudio;
  if (environment.contains("intensity"))
    settings.environment = environment["intensity"].get<float>();
  else if (settings.environment_kind != Kind::kStudio)
    settings.environment = 1.0f;
  if (!image) return;
  const Place place = document.root.at("extensions").at("TESSERA_capture").at("environment");
  Image pixels = read_equirectangular(document, environment, place);
  document.budget.charge(shaders::EnvironmentImage::working_bytes(pixels.height), 1, place);
  capture.environment_image =
      std::make_shared<const shaders::EnvironmentImage>(std::move(pixels), environment.value("rotation", 0.0));
}

}  // namespace tessera::scene::gltf
