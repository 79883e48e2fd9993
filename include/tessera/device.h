#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <tessera/error.h>
#include <tessera/frame.h>
#include <tessera/keys.h>
#include <tessera/scene.h>

namespace tessera {

// A rectangle of the frame in pixels; (0, 0) is the top left.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
};

struct RenderOptions {
  int width = 0, height = 0;       // size of the frame in pixels; 0 takes the scene's size
  std::optional<Region> region;    // rectangle to render; without one, the whole frame
  bool auxiliary = false;          // also keeps depth, normals and invocations (Frame::layers())
  bool resolve_auxiliary = false;  // also keeps the layers and the error of the resolve unit: needs
                                   // resolve.desampling
  std::uint64_t max_image_bytes = 4ull << 30;
};

// The described machine with a scene in it. Images and counters do not depend on the number of threads, on the
// instruction set or on other devices. One thread at a time may use a device; different devices may render at once.
//
//   tessera::Device device(tessera::Scene("eggs.glb"), tessera::Gpu("entry-mobile").set("tile.width", 32));
//   tessera::Frame frame = device.render(14);
class TESSERA_API Device {
 public:
  // Throws InputError for a scene with passes that this machine does not render, UsageError when keys do not fit each
  // other or the region is not inside the frame, and LimitError when images would take more than
  // RenderOptions::max_image_bytes.
  explicit Device(const Scene& scene, const Gpu& gpu = Gpu(), const Settings& settings = Settings(),
                  const RenderOptions& options = {});
  Device(Device&& other) noexcept;
  Device& operator=(Device&& other) noexcept;
  ~Device();

  // Renders one frame; frames count from 0. With frontend.previous_depth_culling or resolve.desampling=adaptive, the
  // frame uses the frame that was rendered before it, if that one has the preceding number.
  Frame render(int frame);

  // Whether the camera was made up, because the scene has none or its View asks for an automatic one.
  bool automatic_camera() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

// Version of this library, for example "0.2.0".
TESSERA_API std::string version();
// The instruction set that kernels use: "AVX3" (AVX-512), "AVX2", "EMU128" or "SCALAR". It is chosen once per
// process.
TESSERA_API std::string simd_target();

}  // namespace tessera
