#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "baselines/baseline_counters.h"
#include "baselines/depth_pyramid.h"
#include "baselines/geometry_pass.h"
#include "baselines/immediate.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "tilecore/tile_job.h"
#include "timing/work.h"

namespace tessera::baselines {

class SchemeWork;

// A pass over one view, the camera's or a light's, as every scheme draws it.
struct Pass {
  const gpu::GpuConfiguration& gpu;
  const tilecore::TileJob& job;
  const binner::TileGrid& bins;  // bins of schemes whose tiles are as large as visibility_stream.gmem_bytes allows
  const DepthPyramid& depths;    // depths of the finished frame, for machines that test against them
};

// The pass after drawing: data that all schemes share.
struct DrawnPass {
  const GeometryCounts& geometry;  // counts of the hull stage and of triangle setup
  const ImmediateFrame& drawn;     // the triangles in the order of drawing, and which are visible
  std::uint64_t frame_bytes;       // bytes that tiles write in the end: the finished frame, attachments or a shadow map
  std::uint64_t loaded_bytes;      // bytes that tiles read before they draw: attachments, or the frame
  std::uint64_t resolved_bytes;    // of frame_bytes, in surfaces with fewer samples than are drawn
  std::uint64_t invocations;       // pixel-shader invocations for visible surfaces
  std::span<const std::uint64_t> tile_state_bytes, bin_state_bytes;  // bytes of colour and depth, by tile and by bin
  const SchemeWork* work;                                            // nullptr: neither cycles nor energy are modelled
};

struct SchemeResult {
  BaselineCounters counters;
  timing::FrameWork work;  // empty without a machine model
};

// A machine that bins or draws triangles.
//
// Contract: begin() once for a pass; add() for each patch that the hull stage kept, in the order of drawing, with its
// triangles by tiles and by bins; finish() once, on any thread. Pass and patches outlive the calls.
class Scheme {
 public:
  virtual ~Scheme() = default;
  virtual void begin(const Pass& pass) = 0;
  virtual void add(const DrawnPatch& patch) = 0;
  virtual SchemeResult finish(const DrawnPass& drawn) = 0;
};

// Machines by number: the rows of baselines/schemes.def.
enum class SchemeId : std::uint8_t {
#define MACHINE(id, name) id,
#define BASELINE(id, name, kind, make) id,
#include "baselines/schemes.def"
#undef MACHINE
#undef BASELINE
};

#define MACHINE(id, name)
#define BASELINE(id, name, kind, make) std::unique_ptr<Scheme> make();
#include "baselines/schemes.def"
#undef MACHINE
#undef BASELINE

// Whether a product treats patches as the machine does; kOurs marks this machine itself.
enum class SchemeKind : std::uint8_t { kOurs, kShipped, kIdealised };

// "ours", "shipped" or "idealised".
constexpr std::string_view name(SchemeKind kind) {
  return std::array<std::string_view, 3>{"ours", "shipped", "idealised"}[static_cast<std::size_t>(kind)];
}

struct SchemeRow {
  std::string_view name;
  SchemeKind kind{};
  std::unique_ptr<Scheme> (*make)() = nullptr;  // nullptr for tessera itself
};
inline constexpr auto kSchemes = std::to_array<SchemeRow>({
#define MACHINE(id, name) {name, SchemeKind::kOurs, nullptr},
#define BASELINE(id, name, kind, make) {name, SchemeKind::kind, make},
#include "baselines/schemes.def"
#undef MACHINE
#undef BASELINE
});
inline constexpr std::size_t kSchemeCount = kSchemes.size();

// Fills in the counters that machines which bin triangles share before their lists: hull stage, tessellation and
// setup. `attributes`: bytes of attributes that are read before the lists.
void take_geometry(const BaselineCounters& geometry, std::uint64_t attributes, BaselineCounters& out);

}  // namespace tessera::baselines
