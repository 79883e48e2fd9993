#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace tessera::bench {

// A context of OpenGL 4.5 on llvmpipe, Mesa's software rasterizer, without a window. `threads` rasterize, beside the
// caller's, which transforms and bins. Throws std::runtime_error when Mesa gives another renderer. One instance per
// process at a time; OpenGL's objects go with it.
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
  std::array<std::uint8_t, 4> front_buffer_{};  // OSMesa insists on one
};

}  // namespace tessera::bench
