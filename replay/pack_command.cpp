#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/error.h"
#include "base/option_numbers.h"
#include "base/output_file.h"
#include "base/text.h"
#include "replay/commands.h"
#include "replay/input_files.h"
#include "replay/pack/meshopt_encoder.h"
#include "replay/pack/packer.h"
#include "replay/progress.h"

namespace tessera::replay {
namespace {

class PackCommand final : public Command {
 public:
  explicit PackCommand(CLI::App& app) {
    app.add_option("IN", source_, "A glTF 2.0 asset (.gltf or .glb)")->required()->type_name("IN.gltf");
    app.add_option("OUT", target_,
                   "The capture to write, with buffers and images inside; a FIFO, a device or /dev/fd/N is written "
                   "through")
        ->required()
        ->type_name("OUT.glb");
    const auto choose_method = [this](const std::string& name) {
      static const std::map<std::string, PackMethod> kMethods = {{"auto", PackMethod::kAuto},
                                                                 {"edgebreaker", PackMethod::kEdgebreaker},
                                                                 {"sequential", PackMethod::kSequential},
                                                                 {"none", PackMethod::kNone}};
      const auto found = kMethods.find(name);
      if (found == kMethods.end())
        throw CLI::ValidationError("--method", name + ": is not auto, edgebreaker, sequential or none");
      options_.method = found->second;
    };
    app.add_option_function<std::string>("--method", choose_method,
                                         "Draco's method: auto, edgebreaker, sequential, or none for no compression "
                                         "(default auto: sequential for Bezier patches, cages and morph targets)")
        ->type_name("METHOD");
    method_ = app.get_option("--method");
    app.add_flag("--meshopt", meshopt_,
                 "Compress with meshoptimizer (EXT_meshopt_compression) instead of Draco, to gltfpack's number of bits")
        ->excludes(method_);
    const auto choose_geometry = [this](const std::string& name) {
      options_.geometry = from_word<scene::GeometryEncoding>(name);
      if (!options_.geometry || *options_.geometry == scene::GeometryEncoding::kRaw)
        throw CLI::ValidationError("--geometry", name + ": is not quantised, meshlet or dgf");
    };
    geometry_ =
        app.add_option_function<std::string>(
               "--geometry", choose_geometry,
               "As --meshopt, but keep positions and triangles by clusters in the encoding of the emulated memory: "
               "quantised, meshlet or dgf (TESSERA_clusters; other viewers cannot read it)")
            ->type_name("ENCODING")
            ->excludes(method_);
    app.add_option("--webp", webp_,
                   "Write images as WebP (EXT_texture_webp): a quality from 0 to 100 (default 80), or lossless")
        ->expected(0, 1)
        ->type_name("[QUALITY]");
    const auto bits = [&](const char* option, int QuantizationBits::*value, const char* what, int least = 1) {
      const std::string with_meshopt = options_.bits.*value == kMeshoptBits.*value
                                           ? ""
                                           : fmt::format(" (default with --meshopt: {})", kMeshoptBits.*value);
      bits_.emplace_back(
          app.add_option(option, options_.bits.*value, fmt::format("Bits that {} keep{}", what, with_meshopt))
              ->check(CLI::Range(least, kMaxBits).description(""))
              ->type_name("N")
              ->capture_default_str(),
          value);
    };
    bits("--position-bits", &QuantizationBits::position, "positions");
    bits("--normal-bits", &QuantizationBits::normal, "normals", 2);  // octahedra need two
    bits("--texcoord-bits", &QuantizationBits::texcoord, "texture coordinates");
    bits("--color-bits", &QuantizationBits::color, "vertex colours");
    bits("--generic-bits", &QuantizationBits::generic, "tangents (of Draco) and weights");
    add_strict_flag(app, options_.strict);
    const char* surfaces = "Surfaces";
    app.add_option("--subdivide", levels_,
                   "Make meshes Catmull-Clark cages: triangles are paired into quads, refined so many times (0 to 4, "
                   "default 1), and drawn as Bezier patches")
        ->expected(0, 1)
        ->type_name("[LEVELS]")
        ->group(surfaces);
    app.add_option("--crease", options_.surfaces.crease_degrees,
                   "With --subdivide: edges bent by more than so many degrees stay sharp (default: none)")
        ->check(CLI::Range(0.0, 180.0).description(""))
        ->type_name("DEGREES")
        ->group(surfaces);
    app.add_flag("--convert", options_.surfaces.convert, "Write the Bezier patches of all cages instead of the cages")
        ->group(surfaces);
    app.add_option("--displace", displace_,
                   "Displace all cages and patches: HEIGHTS is a PNG, JPEG or WebP file, the number of a texture, or "
                   "base-color, metallic-roughness, normal, occlusion or emissive for the material's own; SCALE and "
                   "BIAS in object units (default 2 % of the largest extent, and 0)")
        ->type_name("HEIGHTS[,SCALE[,BIAS]]")
        ->group(surfaces);
    app.add_option(
           "--procedure", procedures_,
           "Draw a program of your own: FILE has a shape, texture or rates (`tessera describe procedures`), NODE "
           "is a node's name or number (default: a new one); may be given several times")
        ->type_name("[NODE=]FILE")
        ->allow_extra_args(false)
        ->group(surfaces);
    subdivide_ = app.get_option("--subdivide");
    webp_option_ = app.get_option("--webp");
    const char* group = "Capture settings";
    app.add_option("--size", size_, "Size of the image")->type_name("WxH")->group(group);
    app.add_option("--frame-rate", frame_rate_, "Frames per second")->type_name("FPS")->group(group);
    add_shutter_option(app, shutter_, group);
    app.add_option("--frames", frames_, "Frames that a replay renders, B not included")->type_name("A:B")->group(group);
    app.add_option("--exposure", exposure_, "Factor on light before the PNG's tone map")->type_name("X")->group(group);
    app.add_option("--environment", environment_, "Brightness of the environment")->type_name("X")->group(group);
    app.add_option("--aperture", options_.aperture_radius,
                   "Radius of the lens of every camera, in scene units; 0 is a pinhole")
        ->type_name("R")
        ->group(group);
    app.add_option("--focus", options_.focus_distance, "Distance in front of the camera that is sharp")
        ->type_name("D")
        ->group(group);
    add_view_options(app, options_.view, kViewGroup);
    app.footer(
        "Examples:\n  tessera pack model.gltf captures/model.glb --size 1280x720 --shutter 0:0.5 --frames 0:24\n"
        "  tessera pack statue.gltf statue.glb --subdivide 2 --displace marble.png,0.02");
  }

  void run() override {
    options_.capture_settings = capture_settings();
    if (options_.aperture_radius) check_number("--aperture", *options_.aperture_radius, 0, kLargest);
    if (options_.focus_distance) check_number("--focus", *options_.focus_distance, 0, kLargest, true);
    options_.view.check();
    if (options_.view.lens && (options_.aperture_radius || options_.focus_distance))
      throw UsageError("--lens sets one camera, --aperture and --focus set every camera: give one of them");
    read_surface_options();
    if (meshopt_ || options_.geometry) read_meshopt_bits();
    if (webp_option_->count() > 0) read_webp_quality();
    check_output_file(target_);
    inputs().check(target_);
    PackReport report;
    {
      const LongStep step("packing " + escape_control(source_), LongStep::quiet_without_terminal());
      report = pack_capture(source_, target_, options_);
    }
    for (const std::string& notice : report.notices)
      fmt::print(beside_outputs({target_}), "{}: {}\n", source_, escape_control(notice, 300));
    print_surfaces(report.surfaces);
    if (report.webp_images > 0)
      fmt::print(beside_outputs({target_}), "{}: {} images as WebP\n", target_, report.webp_images);
    if (options_.geometry)
      fmt::print(beside_outputs({target_}), "{}: {} of {} primitives by clusters ({})\n", target_, report.in_clusters,
                 report.primitives, word(*options_.geometry));
    fmt::print(beside_outputs({target_}), "{}: {} of {} primitives compressed, {} -> {}\n", target_, report.compressed,
               report.primitives, human_bytes(report.bytes_in), human_bytes(report.bytes_out));
  }

 private:
  InputFiles inputs() const {
    InputFiles inputs;
    inputs.add_capture(source_);
    if (options_.surfaces.displace) inputs.add(options_.surfaces.displace->heights);
    for (const ProcedureFile& procedure : options_.procedures) inputs.add(procedure.file);
    return inputs;
  }

  // Members of TESSERA_capture, within the ranges of its schema.
  nlohmann::json capture_settings() const {
    nlohmann::json settings = nlohmann::json::object();
    if (!size_.empty()) {
      const ImageSize size = parse_size("--size", size_);
      settings["resolution"] = {size.width, size.height};
    }
    if (shutter_) {
      const NumberPair shutter = scene::parse_shutter("--shutter", *shutter_);
      settings["shutter"] = {shutter.a, shutter.b};
    }
    if (!frames_.empty()) {
      const FrameRange frames = parse_frames("--frames", frames_);
      settings["frames"] = {{"first", frames.first}, {"count", frames.last - frames.first}};
    }
    if (frame_rate_) settings["frameRate"] = check_number("--frame-rate", *frame_rate_, 0, 1e6, true);
    if (exposure_) settings["exposure"] = check_number("--exposure", *exposure_, 0, 1e6, true);
    if (environment_) settings["environment"] = check_number("--environment", *environment_, 0, 1e6);
    return settings;
  }

  void read_meshopt_bits() {
    options_.method = PackMethod::kMeshopt;
    for (const auto& [option, bits] : bits_) {
      if (option->count() == 0) options_.bits.*bits = kMeshoptBits.*bits;
      if (options_.bits.*bits > kMaxMeshoptBits)
        throw UsageError(
            fmt::format("{} {}: with --meshopt at most {}", option->get_name(), options_.bits.*bits, kMaxMeshoptBits));
    }
  }

  void read_webp_quality() {
    options_.webp.emplace();
    if (webp_.empty()) return;
    if (webp_ == "lossless") {
      options_.webp->quality.reset();
      return;
    }
    const bool number = webp_.size() <= 3 && webp_.find_first_not_of("0123456789") == std::string::npos;
    if (!number || std::stoi(webp_) > 100)
      throw UsageError(fmt::format("--webp {}: expected 0 to 100 or lossless", escape_control(webp_, 40)));
    options_.webp->quality = std::stoi(webp_);
  }

  void read_surface_options() {
    SurfaceOptions& surfaces = options_.surfaces;
    if (subdivide_->count() > 0) {
      if (!levels_.empty() && (levels_.size() > 1 || levels_[0] < '0' || levels_[0] > '4'))
        throw UsageError(fmt::format("--subdivide {}: expected 0 to 4 levels", escape_control(levels_, 40)));
      surfaces.subdivide = levels_.empty() ? 1 : levels_[0] - '0';
    }
    if (surfaces.crease_degrees && !surfaces.subdivide) throw UsageError("--crease needs --subdivide");
    if (!displace_.empty()) surfaces.displace = parse_displace(displace_);
    for (const std::string& procedure : procedures_) options_.procedures.push_back(parse_procedure(procedure));
  }

  void print_surfaces(const SurfaceReport& surfaces) const {
    std::FILE* const words = beside_outputs({target_});
    for (const std::string& notice : surfaces.notices)
      fmt::print(words, "{}: {}\n", source_, escape_control(notice, 300));
    if (surfaces.cages > 0)
      fmt::print(words, "{}: {} cages of {} quads and {} triangles\n", target_, surfaces.cages, surfaces.quads,
                 surfaces.triangles);
    if (surfaces.patches > 0) fmt::print(words, "{}: {} Bezier patches\n", target_, surfaces.patches);
    if (surfaces.displaced_materials > 0)
      fmt::print(words, "{}: {} materials displace\n", target_, surfaces.displaced_materials);
  }

  static constexpr double kLargest = static_cast<double>(std::numeric_limits<float>::max());
  std::string source_, target_, size_, frames_, levels_, displace_, webp_;
  CLI::Option *subdivide_ = nullptr, *method_ = nullptr, *webp_option_ = nullptr, *geometry_ = nullptr;
  std::vector<std::pair<CLI::Option*, int QuantizationBits::*>> bits_;
  std::vector<std::string> procedures_;
  bool meshopt_ = false;
  std::optional<std::string> shutter_;
  std::optional<double> frame_rate_, exposure_, environment_;
  PackOptions options_;
};

}  // namespace

std::unique_ptr<Command> make_pack_command(CLI::App& app) { return std::make_unique<PackCommand>(app); }

}  // namespace tessera::replay
