#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "baselines/baseline_set.h"
#include "gpu/device.h"
#include "gpu/settings.h"
#include "tests/replay/compared.h"

// Frames of several passes beside the schemes, pass by pass.
namespace tessera::test {

using baselines::BaselineCounters;
using baselines::BaselineSet;
using baselines::PassSet;
using hardware::Event;
using memory::Purpose;
using memory::Unit;

// No multiples of a tile.
inline const gpu::RenderRequest kObservedFrame{100, 70, {0, 0, 100, 70}};
inline constexpr std::uint64_t kPixels = 100 * 70;

struct Observed {
  gpu::FrameResult result;
  BaselineSet set;
  std::vector<PassSet> passes;
  baselines::SchemeWorks works;
  const timing::FrameWork& work(SchemeId scheme) const { return works[static_cast<std::size_t>(scheme)]; }
};

// `frames`: number of frames that are rendered; the last one counts.
inline Observed observe(const scene::Capture& capture, const std::vector<std::string>& keys = {},
                        std::size_t thread_count = 0, int frames = 1) {
  const ThreadLimit threads(thread_count);
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  for (const std::string& key : keys) gpu::apply_setting(key, settings, gpu);
  gpu::Device device(capture, gpu, settings, kObservedFrame);
  baselines::BaselineObserver schemes;
  device.set_observer(&schemes);
  gpu::FrameResult result = device.render(capture.settings.first_frame);
  for (int frame = 1; frame < frames; ++frame) result = device.render(capture.settings.first_frame + frame);
  return {std::move(result), schemes.last(), schemes.passes(), schemes.works()};
}

inline std::size_t index(SchemeId scheme) { return static_cast<std::size_t>(scheme); }

// Bytes that a pass of a frame's work moves.
inline std::uint64_t bytes_of(const timing::FrameWork& work, std::size_t pass) {
  std::uint64_t bytes = 0;
  for (const timing::WorkRound& round : work.rounds) {
    if (round.pass != pass) continue;
    bytes += round.geometry.dram_bytes;
    for (const timing::TileWork& tile : round.tiles)
      for (const std::uint64_t phase : tile.dram_bytes) bytes += phase;
  }
  return bytes;
}

// Pairs of a scheme and a pass whose work moves other bytes than the scheme counts there.
inline int passes_out_of_balance(const Observed& of) {
  int wrong = 0;
  for (const SchemeId s : triangle_schemes())
    for (std::size_t pass = 0; pass < of.passes.size(); ++pass) {
      const BaselineCounters& counters = of.passes[pass].set[s];
      wrong += bytes_of(of.work(s), pass) != counters.dram_bytes + counters.texture_bytes ? 1 : 0;
    }
  return wrong;
}

// The frame's bytes, and the bytes of its passes, in each scheme's work and counters. Returns the number of differences.
inline int out_of_balance(const Observed& of) {
  int wrong = passes_out_of_balance(of);
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s)
    wrong += of.works[s].dram_bytes() != of.set.schemes[s].dram_bytes + of.set.schemes[s].texture_bytes ? 1 : 0;
  return wrong;
}

// Pairs of a counter and a scheme whose value in the frame is not the sum over its passes; cycles and energies are not compared.
inline int counters_out_of_balance(const Observed& of) {
  int wrong = 0;
  for (std::size_t s = 0; s < baselines::kSchemeCount; ++s) {
    BaselineCounters sum;
    for (const PassSet& pass : of.passes) merge(sum, pass.set.schemes[s]);
    sum.cycles = of.set.schemes[s].cycles, sum.energy_nj = of.set.schemes[s].energy_nj;
    for (const auto& field : kCounterFields<BaselineCounters>)
      wrong += of.set.schemes[s].*field.member != sum.*field.member ? 1 : 0;
  }
  return wrong;
}

// Events that schemes with tiles take over from the machine, in a pass.
inline hardware::EventCounts shading_of(const timing::FrameWork& work, std::size_t pass) {
  hardware::EventCounts sum;
  for (const timing::WorkRound& round : work.rounds) {
    if (round.pass != pass) continue;
    for (const timing::TileWork& tile : round.tiles)
      for (const Event event : {Event::kShaderInvocations, Event::kTexels, Event::kBlendedLayers, Event::kPixels,
                                Event::kResolveOperations, Event::kAlphaTests, Event::kImageTexels, Event::kImageLanes})
        sum[event] += tile.events[event];
  }
  return sum;
}

// The schemes that draw the pass in tiles.
inline std::vector<SchemeId> tiled(const Observed& of, std::size_t pass) {
  std::vector<SchemeId> out;
  for (const SchemeId s : triangle_schemes()) {
    const BaselineCounters& counters = of.passes[pass].set[s];
    const bool at_once = s == SchemeId::kImmediate || (s == SchemeId::kUntiled && counters.entries == 0);
    if (!at_once) out.push_back(s);
  }
  return out;
}

// Pairs of a pass and a scheme with tiles that shades otherwise than the machine.
inline int passes_shaded_otherwise(const Observed& of) {
  int wrong = 0;
  for (std::size_t pass = 0; pass < of.passes.size(); ++pass)
    for (const SchemeId s : tiled(of, pass))
      wrong += shading_of(of.work(s), pass) != shading_of(of.work(SchemeId::kTessera), pass) ? 1 : 0;
  return wrong;
}

// Attachments, maps and the image behind surfaces that transmit, and data that wait for the light of a stored G-buffer: bytes of the machine's ledger, pass by pass. `lost`: bytes
// that the check leaves out.
inline int passes_stored_otherwise(const Observed& of, std::uint64_t lost = 0) {
  int wrong = 0;
  for (std::size_t pass = 0; pass < of.passes.size(); ++pass) {
    const memory::Ledger& ledger = of.result.passes[pass].counters.ledger;
    const bool image = pass + of.result.image_passes >= of.passes.size();
    std::uint64_t stored = ledger.traffic(Unit::kTilecore, Purpose::kTileState).written_bytes, loaded = 0;
    for (const Purpose purpose :
         {Purpose::kFrameBuffer, Purpose::kAttachment, Purpose::kShadowMap, Purpose::kSceneColor})
      stored += ledger.traffic(Unit::kResolve, purpose).written_bytes;
    for (const Purpose purpose : {Purpose::kFrameBuffer, Purpose::kAttachment, Purpose::kTileState})
      loaded += ledger.traffic(Unit::kTilecore, purpose).read_bytes;
    loaded += ledger.traffic(Unit::kResolve, Purpose::kSceneColor).read_bytes;
    if (image) loaded += ledger.traffic(Unit::kTilecore, Purpose::kAttributes).read_bytes;  // records of lights
    for (const SchemeId s : tiled(of, pass)) {
      if (std::find(kMeshShaders.begin(), kMeshShaders.end(), s) != kMeshShaders.end())
        continue;  // they also move a pyramid of depths
      const BaselineCounters& counters = of.passes[pass].set[s];
      wrong += counters.frame_bytes_written != stored - lost || counters.frame_bytes_read != loaded ? 1 : 0;
    }
  }
  return wrong;
}

// Keys of a machine, and their name in messages.
struct ObservedSetting {
  const char* name;
  std::vector<std::string> keys;
  bool has_partial_renders = false;
};

// BW1, BW2, OBS1 and OBS2 in each pass, with their failing twins: a byte lost in what passes store, and a burst too many in a pass
// that draws.
inline void expect_invariants(Observed& of, const ObservedSetting& setting) {
  ASSERT_EQ(of.passes.size(), of.result.passes.size()) << setting.name;
  for (std::size_t k = 0; k < of.passes.size(); ++k) EXPECT_EQ(of.passes[k].name, of.result.passes[k].name);
  EXPECT_EQ(out_of_balance(of), 0) << setting.name;
  EXPECT_EQ(counters_out_of_balance(of), 0) << setting.name;
  EXPECT_EQ(passes_shaded_otherwise(of), 0) << setting.name;
  if (!setting.has_partial_renders) {
    EXPECT_EQ(passes_stored_otherwise(of), 0) << setting.name;
    EXPECT_GT(passes_stored_otherwise(of, 1), 0) << setting.name;
  }
  const memory::Traffic all = of.result.counters.ledger.total();
  const BaselineCounters& tessera = of.set[SchemeId::kTessera];
  EXPECT_EQ(tessera.dram_bytes + tessera.texture_bytes, all.read_bytes + all.written_bytes) << setting.name;
  for (const BaselineCounters& scheme : of.set.schemes) EXPECT_GT(scheme.cycles, 0u) << setting.name;
  of.works[index(SchemeId::kImmediate)].rounds.front().tiles.back().dram_bytes.back() += 64;
  EXPECT_EQ(out_of_balance(of), 2) << setting.name;
}

inline const PassSet& pass_named(const Observed& of, std::string_view name) {
  const auto found = std::ranges::find(of.passes, name, &PassSet::name);
  EXPECT_NE(found, of.passes.end()) << name;
  return *found;
}

}  // namespace tessera::test
