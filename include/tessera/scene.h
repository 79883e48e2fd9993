#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tessera/error.h>

namespace tessera {

// How a file is read, and the limits of reading it. A file that exceeds one is refused with a LimitError before memory is allocated.
struct ReadLimits {
  std::uint64_t max_bytes = 4ull << 30;       // decoded data of one scene, all together
  std::uint64_t max_file_bytes = 2ull << 30;  // any one file
  // Strict reading makes every violation of glTF an InputError. Otherwise a violation whose meaning is clear becomes
  // one of Scene::notices().
  bool strict = false;
  // Variant of KHR_materials_variants whose materials are drawn, one of Scene::variants(). Without it, the file's
  // default materials are drawn. A name that the file lacks is a UsageError that lists the file's names.
  std::optional<std::string> variant{};
};

// Overrides of the file's own view: each member takes the words of the option of the same name (--scene, --camera,
// --animation, --orbit, --lens, --shutter).
struct View {
  std::optional<std::string> scene{};  // name or number
  std::optional<std::string>
      camera{};  // name or number of a camera, or name of a node with one; "auto" frames the scene
  std::optional<std::string> animation{};  // name or number of the only one that plays; or "all", "none"
  std::optional<std::string> orbit{};      // frames the scene from "DEGREES[:ELEVATION]" around it
  std::optional<std::string> lens{};       // "RADIUS[:FOCUS]" in scene units
  std::optional<std::string> shutter{};    // "OPEN:CLOSE" in fractions of a frame
};

// A light for which the file requests shadows.
struct Shadow {
  int light = 0;        // index in the file's lights; every node that has it casts
  int size = 0;         // texels along a map's side
  int cascades = 1;     // maps of a directional light
  double distance = 0;  // reach from the camera in scene units; 0: to the end of the scene
};

// A capture: a scene and the way in which its file wants it drawn. Immutable; copies share one content, and any
// number of devices on any threads may render it.
class TESSERA_API Scene {
 public:
  // Reads any glTF 2.0 asset (.gltf or .glb). The file is not trusted. Throws InputError for content that glTF
  // forbids; UsageError for a variant, scene, camera or animation that the file lacks (the message lists the names
  // that it has) and for invalid words in `view`; LimitError; SystemError.
  explicit Scene(const std::filesystem::path& file, const ReadLimits& limits = {}, const View& view = {});

  const std::filesystem::path& file() const;
  // Size of the image that the file asks for, in pixels; 1280x720 if it asks for none.
  int width() const;
  int height() const;
  // The file asks for the frames from first_frame() to first_frame() + frame_count() - 1; any other frame renders as well.
  int first_frame() const;
  int frame_count() const;
  double frame_rate() const;  // per second
  // The lights that the file wants to cast shadows. If there is none, light passes through all surfaces.
  const std::vector<std::string>& variants() const;
  // The lights that the file wants to cast shadows; without any, lights shine through everything.
  std::vector<Shadow> shadows() const;
  // Names of the passes that the file describes; empty where passes follow from shadows, materials and settings. A
  // Device refuses passes that this machine does not render (InputError).
  std::vector<std::string> passes() const;
  // Messages about content that the reader skipped or assumed; one line each.
  const std::vector<std::string>& notices() const;

  struct Content;

 private:
  friend class Device;
  std::shared_ptr<const Content> content_;
};

}  // namespace tessera
