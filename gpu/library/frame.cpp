#include <tessera/frame.h>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "gpu/counter_list.h"
#include "gpu/library/contents.h"
#include "shaders_cpp/tone_map.h"

namespace tessera {
namespace {

template <class T>
ImageView<T> view(const ImageOf<T>& image) {
  return {image.width, image.height, image.channels, image.values};
}

// The layers that a frame may have, and the members that hold them.
struct Layer {
  const char* name;
  Image tilecore::FrameTargets::*image;
};
constexpr std::array<Layer, 10> kLayers = {{{"color", &tilecore::FrameTargets::color},
                                            {"depth", &tilecore::FrameTargets::depth},
                                            {"normal", &tilecore::FrameTargets::normal},
                                            {"invocations", &tilecore::FrameTargets::invocations},
                                            {"rate", &tilecore::FrameTargets::rate},
                                            {"velocity", &tilecore::FrameTargets::velocity},
                                            {"edges", &tilecore::FrameTargets::edges},
                                            {"discrepancy", &tilecore::FrameTargets::discrepancy},
                                            {"origin", &tilecore::FrameTargets::origin},
                                            {"error", &tilecore::FrameTargets::error}}};

std::vector<DrawableCost> drawable_rows(const scene::Assembly& assembly, const gpu::DrawableCosts& costs) {
  const scene::Capture& capture = *assembly.capture;
  const auto named = [](const auto& things, int index) {
    return index >= 0 && static_cast<std::size_t>(index) < things.size() ? things[static_cast<std::size_t>(index)].name
                                                                         : std::string();
  };
  std::vector<DrawableCost> rows(assembly.drawn.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const scene::DrawnPrimitive& drawn = assembly.drawn[r];
    const scene::Drawable& drawable = assembly.drawables[drawn.first_drawable];
    DrawableCost& row = rows[r];
    row.node = drawable.node, row.mesh = drawable.mesh, row.primitive = drawable.primitive;
    row.material = assembly.material_source[static_cast<std::size_t>(drawable.material)];
    row.node_name = named(capture.nodes, row.node), row.mesh_name = named(capture.meshes, row.mesh),
    row.material_name = named(capture.materials, row.material);
    row.instances = drawn.count;
    row.base_patches = std::uint64_t{drawable.patch_count} * drawn.count;
    for (const gpu::DrawableCost& cost : gpu::kDrawableCosts) {
      std::uint64_t& sum = row.costs[std::string(cost.name)];
      for (std::uint32_t i = 0; i < drawn.count; ++i)
        if (const std::uint32_t d = drawn.drawable(i); d < costs.size()) sum += costs[d].*cost.member;
    }
  }
  return rows;
}

}  // namespace

const std::vector<CounterDescription>& counter_descriptions() {
  static const std::vector<CounterDescription> kDescriptions = [] {
    std::vector<CounterDescription> out;
    for (const gpu::CounterInfo& info : gpu::counter_infos())
      out.push_back({std::string(info.name), std::string(info.unit), info.over_frames == Combine::kSum ? "sum" : "peak",
                     std::string(info.meaning), std::string(info.vendor)});
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return out;
  }();
  return kDescriptions;
}

const std::vector<DrawableCostDescription>& drawable_cost_descriptions() {
  static const std::vector<DrawableCostDescription> kDescriptions = [] {
    std::vector<DrawableCostDescription> out;
    out.reserve(std::size(gpu::kDrawableCosts));
    for (const gpu::DrawableCost& cost : gpu::kDrawableCosts)
      out.push_back(
          {std::string(cost.name), std::string(cost.unit), std::string(cost.meaning), std::string(cost.counter)});
    return out;
  }();
  return kDescriptions;
}

namespace {

std::vector<TrafficRow> traffic_of(const memory::Ledger& ledger) {
  std::vector<TrafficRow> rows;
  for (const gpu::TrafficRow& row : gpu::traffic_rows(ledger))
    rows.push_back({std::string(name(row.unit)), std::string(name(row.purpose)), row.traffic.read_bytes,
                    row.traffic.written_bytes});
  return rows;
}

std::vector<FramePass> passes_of(const gpu::FrameResult& result) {
  std::vector<FramePass> passes;
  for (const gpu::PassResult& of : result.passes) {
    FramePass& pass = passes.emplace_back();
    pass.name = of.name;
    for (const auto& [counter, value] : gpu::counter_values(of.counters)) pass.counters.emplace(counter, value);
    pass.traffic = traffic_of(of.counters.ledger);
    if (!result.model) continue;
    const std::vector<timing::PassTime>& times = result.model->timing.passes;
    const auto time = std::ranges::find(times, of.name, &timing::PassTime::name);
    if (time != times.end()) pass.begin_cycles = time->begin, pass.end_cycles = time->end;
  }
  return passes;
}

}  // namespace

Frame::Content::Content(gpu::FrameResult rendered, const scene::Assembly& assembly, float display_exposure)
    : result(std::move(rendered)), exposure(display_exposure) {
  for (const auto& [name, value] : gpu::counter_values(result.counters)) counters.emplace(name, value);
  traffic = traffic_of(result.counters.ledger);
  passes = passes_of(result);
  if (result.model) {
    const auto& machine = result.model->timing;
    timing.emplace();
    timing->cycles = machine.cycles;
    timing->latency_cycles = machine.latency;
    for (const auto& [unit, busy] : gpu::busy_cycles(machine)) timing->busy_cycles.emplace(unit, busy);
    if (machine.bound_by) timing->bound_by = name(*machine.bound_by);
    timing->bound_by_cycles = machine.bound_cycles;
    energy = FrameEnergy{result.model->energy.total_nj(), result.model->energy.by_unit_nj};
    area = MachineArea{result.model->area.total_mm2(), result.model->area.by_unit_mm2};
    result.model.reset();  // frees the schedule of every tile
  }
  const gpu::TileMaps& tiles = result.maps;
  for (const gpu::TileMapField& field : gpu::kTileMapFields)
    maps.push_back({std::string(field.name), std::string(field.unit), std::string(field.meaning),
                    std::string(field.counter), tiles.columns, tiles.rows, tiles.x0, tiles.y0, tiles.tile_width,
                    tiles.tile_height, tiles.tiles.empty() ? nullptr : &(tiles.tiles.front().*field.member),
                    sizeof(gpu::TileCounts) / sizeof(std::uint64_t)});
  drawables = drawable_rows(assembly, result.drawables);
}

const tilecore::FrameTargets& Frame::Content::targets(Eye eye) const {
  if (eye == Eye::kLeft) return result.targets;
  if (!result.right) throw UsageError("the frame has no right eye; stereo.eye_separation asks for one");
  return result.right->targets;
}

const Image8& Frame::Content::display(Eye eye) const {
  const tilecore::FrameTargets& images = targets(eye);
  const std::size_t index = eye == Eye::kLeft ? 0 : 1;
  std::call_once(once_[index], [&] { display_[index] = shaders::to_display(images.color, exposure); });
  return display_[index];
}

Frame::Frame(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

int Frame::number() const { return content_->result.frame; }
bool Frame::has_right_eye() const { return content_->result.right.has_value(); }

std::vector<std::string> Frame::layers() const {
  std::vector<std::string> names;
  for (const Layer& layer : kLayers)
    if (!(content_->result.targets.*layer.image).values.empty()) names.emplace_back(layer.name);
  return names;
}

ImageView<float> Frame::image(std::string_view layer, Eye eye) const {
  const tilecore::FrameTargets& images = content_->targets(eye);
  for (const Layer& known : kLayers)
    if (layer == known.name && !(images.*known.image).values.empty()) return view(images.*known.image);
  throw UsageError(fmt::format("the frame has no layer '{}'; it has {}", layer, fmt::join(layers(), ", ")));
}

ImageView<std::uint8_t> Frame::display(Eye eye) const { return view(content_->display(eye)); }

ImageView<std::uint32_t> Frame::patches(Eye eye) const {
  const tilecore::FrameTargets& images = content_->targets(eye);
  if (images.patch.values.empty()) throw UsageError("the frame has no patches; RenderOptions::auxiliary asks for them");
  return view(images.patch);
}

const std::map<std::string, std::uint64_t>& Frame::counters() const { return content_->counters; }
const std::vector<TrafficRow>& Frame::traffic() const { return content_->traffic; }
const std::vector<FramePass>& Frame::passes() const { return content_->passes; }
const std::optional<FrameTiming>& Frame::timing() const { return content_->timing; }
const std::optional<FrameEnergy>& Frame::energy() const { return content_->energy; }
const std::optional<MachineArea>& Frame::area() const { return content_->area; }
const std::vector<TileMap>& Frame::tile_maps() const { return content_->maps; }
const std::vector<DrawableCost>& Frame::drawables() const { return content_->drawables; }
const std::map<std::string, bool>& Frame::effects() const { return content_->result.effects; }
double Frame::host_seconds() const { return content_->result.seconds; }
const std::map<std::string, double>& Frame::stage_seconds() const { return content_->result.stage_seconds; }

}  // namespace tessera
