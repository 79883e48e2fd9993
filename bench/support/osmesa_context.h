#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace tessera::bench {

// A context of OpenGL 4.5 on llvmpipe, Mesa's software rasterizer, without a window. `threads` threads rasterize,
// beside the caller's, which transforms and bins. Throws std::runtime_error if Mesa gives another renderer. A process
// may have one instance at a time; OpenGL's objects are deleted with it.
class OsMesaContext {
 public:
  explicit OsMesaContext(int threads);
  OsMesaContext(const OsMesaContext&) = delete;
  OsMesaContext& operator=(const OsMesaContext&) = delete;
  ~OsMesaContext();

  const std::string& renderer() const { return renderer_; }

 private:
  std::string renderer_;
  void* context_ = nullptr;
  std::array<std::uint8_t, 4> front_buffer_{};  // OSMesa requires a buffer
};

}  // namespace tessera::bench
