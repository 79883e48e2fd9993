#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tessera/error.h>

namespace tessera {

// Pixels of a frame: channels interleaved, row by row from the top left. Valid while the frame or a copy of it lives.
template <class T>
struct ImageView {
  int width = 0, height = 0, channels = 0;
  std::span<const T> values;  // height * width * channels

  std::span<const T> at(int x, int y) const {
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    return values.subspan(pixel * static_cast<std::size_t>(channels), static_cast<std::size_t>(channels));
  }
};

// The work of one kind in every tile of a frame. Valid while the frame or a copy of it lives.
struct TileMap {
  std::string name, unit, meaning;
  std::string counter;  // the counter of the frame that the tiles add up to; "" when there is none
  int columns = 0, rows = 0;
  int x0 = 0, y0 = 0;                    // pixel of the frame at which the first tile begins
  int tile_width = 0, tile_height = 0;   // pixels
  const std::uint64_t* first = nullptr;  // value of the tile at the top left
  std::size_t stride = 0;                // distance in values from a tile to the next; tiles lie row by row

  std::uint64_t at(int column, int row) const {
    const auto tile =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
    return first[tile * stride];
  }
};

// The work that a drawable of a frame caused in the tile cores. A drawable is one primitive of a mesh, or one
// procedure, at one node, with all instances of the node. Both eyes and second passes are included.
struct DrawableCost {
  int node = 0, mesh = 0, primitive = 0, material = 0;  // indices in the file; -1 where it has none
  std::string node_name, mesh_name, material_name;      // "" where the file names none
  std::uint64_t instances = 1;                          // number of instances of the node; 1 where it has none
  std::uint64_t base_patches = 0;                       // units that the front end bounds, over all instances
  // Cost by name; drawable_cost_descriptions() lists the names.
  std::map<std::string, std::uint64_t> costs;
};

// Description of one cost of a drawable.
struct DrawableCostDescription {
  std::string name, unit, meaning;
  std::string counter;  // the counter of the frame that the drawables add up to; "" when there is none
};

// All costs that drawables have.
TESSERA_API const std::vector<DrawableCostDescription>& drawable_cost_descriptions();

// Bytes that a unit moved over the external memory interface for one purpose.
struct TrafficRow {
  std::string unit, purpose;
  std::uint64_t read_bytes = 0, written_bytes = 0;
};

// Cycles of a frame on the described machine.
struct FrameTiming {
  double cycles = 0;                          // from the end of the frame before to the end of this one
  double latency_cycles = 0;                  // from the frame's first patch to its last pixel
  std::map<std::string, double> busy_cycles;  // by unit; the mean over the cores for a unit that each core has
  std::string bound_by;        // the limit of the frame: a unit, or tilecores, geometry, latency, l2, caches,
                               // tile_memory, imbalance; "" where nothing was done
  double bound_by_cycles = 0;  // cycles that doubling this limit would save
};

// A pass of a frame: what it counted and moved, and when it ran. Counters of all passes add up to the frame's, but for peaks;
// with a right eye the passes are the left eye's.
struct FramePass {
  std::string name;  // as in the file, or "shadow 0.1", "prepass", "main", "bloom down 0", ...
  std::map<std::string, std::uint64_t> counters;  // as Frame::counters()
  std::vector<TrafficRow> traffic;
  // Cycles from the beginning of the frame; 0 both with output.machine_model=false. Passes may overlap (machine.overlap).
  double begin_cycles = 0, end_cycles = 0;
};

// Energy of a frame on the described machine.
struct FrameEnergy {
  double total_nj = 0;
  std::map<std::string, double> by_unit_nj;
};

// Area of the described machine.
struct MachineArea {
  double total_mm2 = 0;
  std::map<std::string, double> by_unit_mm2;
};

// Description of a counter; `tessera describe counters` prints the same.
struct CounterDescription {
  std::string name;  // "unit.event"
  std::string unit;
  std::string over_frames;  // "sum" or "peak": how values of several frames become one
  std::string meaning;
  std::string vendor;  // similar counters of vendors' tools; "" when there is none
};

// All counters that a frame can have, by name.
TESSERA_API const std::vector<CounterDescription>& counter_descriptions();

// With stereo.eye_separation a frame has two images.
enum class Eye { kLeft, kRight };

// A rendered frame. Immutable; copies share one content, which outlives the device. Any thread may read it.
// References that it returns live as long as the frame or a copy of it: name the frame before looping over its
// counters.
class TESSERA_API Frame {
 public:
  int number() const;
  bool has_right_eye() const;

  // Names for image(): "color"; with RenderOptions::auxiliary also "depth", "normal" and "invocations"; with
  // RenderOptions::resolve_auxiliary "rate", "velocity", "edges", "discrepancy", "origin" and "error".
  std::vector<std::string> layers() const;
  // "color" is linear light and coverage (RGBA). Throws UsageError for a layer or an eye that the frame does not have.
  ImageView<float> image(std::string_view layer = "color", Eye eye = Eye::kLeft) const;
  // The frame as a screen shows it, 8-bit sRGB after exposure, tone map and transfer function of output.exposure.
  ImageView<std::uint8_t> display(Eye eye = Eye::kLeft) const;
  // Number of the base patch that each pixel's first sample shows, plus 1; 0 where the sample shows no surface. Needs
  // RenderOptions::auxiliary.
  ImageView<std::uint32_t> patches(Eye eye = Eye::kLeft) const;

  // "unit.event" -> count, both eyes together. A counter whose unit did not run is absent.
  const std::map<std::string, std::uint64_t>& counters() const;
  const std::vector<TrafficRow>& traffic() const;
  // In the order in which they began.
  const std::vector<FramePass>& passes() const;
  // Empty with output.machine_model=false.
  const std::optional<FrameTiming>& timing() const;
  const std::optional<FrameEnergy>& energy() const;
  const std::optional<MachineArea>& area() const;
  const std::vector<TileMap>& tile_maps() const;
  // Costs of all drawables in the order in which nodes draw. Drawables without work in this frame have zeros.
  const std::vector<DrawableCost>& drawables() const;
  // Effects of docs/shading.md and whether they ran.
  const std::map<std::string, bool>& effects() const;

  // Time on the host for the frame and for each of its stages. "tile_threads" and "resolve_threads" are sums over
  // threads.
  double host_seconds() const;
  const std::map<std::string, double>& stage_seconds() const;

  struct Content;

 private:
  friend class Device;
  explicit Frame(std::shared_ptr<const Content> content);
  std::shared_ptr<const Content> content_;
};

}  // namespace tessera
