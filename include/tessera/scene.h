#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tessera/error.h>

namespace tessera {

// How a file is read, and what that may cost; more is refused with a LimitError before it is allocated.
struct ReadLimits {
  std::uint64_t max_bytes = 4ull << 30;       // decoded data of one scene, all together
  std::uint64_t max_file_bytes = 2ull << 30;  // any one file
  // What glTF forbids is an InputError also where its meaning is clear; else it is one of Scene::notices().
  bool strict = false;
  // KHR_materials_variants: whose materials are drawn, by name, one of Scene::variants(); without, those that the file
  // draws by itself. A name that the file lacks is a UsageError that lists its names.
  std::optional<std::string> variant{};
};

// What of a file is drawn and how it is looked at, where that is not what the file says: the words of the options
// --scene, --camera, --animation, --orbit, --lens and --shutter, with the same meaning.
struct View {
  std::optional<std::string> scene{};      // name or number
  std::optional<std::string> camera{};     // name or number, or that of a node; "auto": the scene is framed
  std::optional<std::string> animation{};  // name or number of the only one that plays; "all", "none"
  std::optional<std::string> orbit{};      // frames the scene from "DEGREES[:ELEVATION]" around it
  std::optional<std::string> lens{};       // "RADIUS[:FOCUS]" in scene units
  std::optional<std::string> shutter{};    // "OPEN:CLOSE" in fractions of a frame
};

// A light that casts shadows, as a file asks for it.
struct Shadow {
  int light = 0;        // of the file's lights; every node that has it casts
  int size = 0;         // texels along a map's side
  int cascades = 1;     // maps of a directional light
  double distance = 0;  // scene units from the camera that they reach; 0: as far as the scene does
};

// A capture: what is drawn, and how its file wants it to be drawn. Immutable; copies share one content, and any number
// of devices on any threads may render it.
class TESSERA_API Scene {
 public:
  // Reads any glTF 2.0 asset (.gltf or .glb). The file is not trusted.
  // Throws InputError for what glTF forbids, UsageError for a variant, scene, camera or animation that the file lacks,
  // which lists those that it has, and for words of `view` that mean nothing, LimitError, SystemError.
  explicit Scene(const std::filesystem::path& file, const ReadLimits& limits = {}, const View& view = {});

  const std::filesystem::path& file() const;
  // Of the image that the file asks for, in pixels; 1280x720 if it does not.
  int width() const;
  int height() const;
  // The frames that the file asks for are first_frame() to first_frame() + frame_count() - 1; any other renders as well.
  int first_frame() const;
  int frame_count() const;
  double frame_rate() const;  // per second
  // Names of the file's variants of materials; empty where it has none.
  const std::vector<std::string>& variants() const;
  // The lights that the file wants to cast shadows; without any, lights shine through everything.
  std::vector<Shadow> shadows() const;
  // Names of the passes that the file describes; empty where passes follow from shadows, materials and settings. A Device
  // refuses passes that this machine does not render (InputError).
  std::vector<std::string> passes() const;
  // What the reader skipped or assumed, for people; one line each.
  const std::vector<std::string>& notices() const;

  struct Content;

 private:
  friend class Device;
  std::shared_ptr<const Content> content_;
};

}  // namespace tessera
