#include "gpu/dram_bursts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace tessera::gpu {
namespace {

using memory::Access;
using memory::Burst;
using memory::Purpose;
using timing::kPhaseCount;

// Of a cluster of 64 vertices at both motion keys with 124 cells and all attributes, and its bursts.
constexpr std::uint64_t kMaxRecordBytes = 8192;

// Cuts accesses into bursts and spreads them over [begin, end).
class Spreader {
 public:
  Spreader(const memory::AddressMap& map, std::uint64_t burst_bytes, std::vector<Burst>& out)
      : map_(map), burst_bytes_(burst_bytes), out_(out) {}

  void add(const Access& access, std::uint64_t tile) {
    for (std::uint64_t at = 0; at < access.bytes; at += burst_bytes_)
      addresses_.push_back({map_.address(access, tile) + at, access.write});
  }
  void spread(double begin, double end) {
    const double step = addresses_.empty() ? 0 : (end - begin) / static_cast<double>(addresses_.size());
    for (std::size_t i = 0; i < addresses_.size(); ++i)
      out_.push_back({static_cast<std::uint64_t>(begin + step * static_cast<double>(i)), addresses_[i].first,
                      addresses_[i].second});
    addresses_.clear();
  }

 private:
  const memory::AddressMap& map_;
  std::uint64_t burst_bytes_;
  std::vector<Burst>& out_;
  std::vector<std::pair<std::uint64_t, bool>> addresses_;
};

void add_tile(const std::vector<Access>& accesses, const timing::TileSchedule& scheduled, std::uint64_t tile,
              Spreader& spreader) {
  for (std::size_t p = 0; p < kPhaseCount; ++p) {
    for (const Access& access : accesses)
      if (timing::phase_of(access.unit, access.purpose, access.write) == static_cast<timing::Phase>(p))
        spreader.add(access, tile);
    spreader.spread(scheduled.phases[p].begin, scheduled.phases[p].end);
  }
}

}  // namespace

std::vector<Burst> frame_bursts(const MachineModel& model, const memory::AddressMap& map, std::uint64_t burst_bytes) {
  std::vector<Burst> bursts;
  Spreader spreader(map, burst_bytes, bursts);
  std::size_t next = 0;
  for (std::size_t r = 0; r < model.record.accesses.size(); ++r) {
    const FrameRecord::RoundAccesses& round = model.record.accesses[r];
    for (const Access& access : round.geometry) spreader.add(access, 0);
    spreader.spread(model.schedule.geometry[r].begin, model.schedule.geometry[r].end);
    for (std::size_t i = 0; i < round.tiles.size(); ++i, ++next)
      add_tile(round.tiles[i], model.schedule.tiles[next], model.record.work.rounds[r].tiles[i].tile, spreader);
  }
  // What the rounds do not hold has no addresses of its own: one stream behind the parameter buffer's first 4 GiB.
  const memory::Traffic& other = model.record.other;
  spreader.add({std::uint64_t{1} << 32, other.read_bytes, memory::Unit::kResolve, Purpose::kTileQueue, false}, 0);
  spreader.add({(std::uint64_t{1} << 32) + other.read_bytes, other.written_bytes, memory::Unit::kResolve,
                Purpose::kTileQueue, true},
               0);
  spreader.spread(model.schedule.other.begin, model.schedule.other.end);
  std::stable_sort(bursts.begin(), bursts.end(), [](const Burst& a, const Burst& b) { return a.cycle < b.cycle; });
  return bursts;
}

memory::AddressMap address_map(const Device& renderer, const GpuConfiguration& gpu, const RunSettings& settings,
                               const RenderRequest& request) {
  const binner::TileGrid grid(request.width, request.height, gpu.tile.width, gpu.tile.height, request.region);
  const auto samples =
      static_cast<std::uint64_t>(gpu.tile.width * gpu.tile.height * settings.sampling.samples_per_pixel);
  const std::uint64_t of_sample =
      tilecore::TileState::bytes_per_sample(true) +
      static_cast<std::uint64_t>(gpu.tilecore.blend_layers) * tilecore::TileState::bytes_per_layer(true);
  const SignatureMemory signatures(eliminates(gpu) ? grid.tile_count() : 0, renderer.frame_store().signature_bytes(),
                                   static_cast<std::uint64_t>(gpu.memory.burst_bytes));
  const scene::Assembly& assembly = renderer.assembly();
  std::uint64_t instances = 0;
  for (const scene::InstancedNode& node : assembly.instanced_nodes)
    instances += node.order.size() * frontend::kInstanceRecordBytes + node.groups.size() * kMaxRecordBytes;
  std::uint64_t groups = 0;
  for (const auto* of_kind : {&assembly.cluster_groups, &assembly.bezier_groups})
    for (const scene::PatchGroups& of_primitive : *of_kind)
      groups += of_primitive.box_count() * (frontend::kPatchGroupBoxBytes + frontend::kPatchGroupHeaderBytes) +
                of_primitive.levels.size() * kMaxRecordBytes;
  return memory::AddressMap({assembly.record_count * kMaxRecordBytes + instances + groups,
                             renderer.record_lines() * static_cast<std::uint64_t>(gpu.line_bytes()),
                             renderer.texture_lines() * static_cast<std::uint64_t>(gpu.line_bytes()),
                             tilecore::TileStore::frame_bytes(renderer.frame_store(), request.region),
                             grid.tile_count(), samples * of_sample, signatures.bytes(), renderer.scene_color_bytes()});
}

}  // namespace tessera::gpu
