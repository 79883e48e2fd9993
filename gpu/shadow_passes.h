#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gpu/pipeline.h"
#include "gpu/settings.h"
#include "scene/light_views.h"
#include "tilecore/shading/frame_shadows.h"

namespace tessera::gpu {

// The maps of a capture's lights, and the passes that draw them: one for each map, before what looks them up.
class ShadowPasses {
 public:
  // All must outlive it. Throws LimitError where more lights cast than scene::ShadowRequest::kMaxLights, BudgetError where their maps
  // take more memory than reading the capture left.
  ShadowPasses(const scene::Assembly& assembly, const frontend::PyramidLibrary& pyramids, const GpuConfiguration& gpu,
               const RunSettings& settings, Pipeline::Cores cores);

  // Of all lights that may cast in some frame; none: nothing casts.
  std::span<const tilecore::DepthMaps> maps() const { return maps_; }
  // Whether a node's light casts, and its maps.
  const tilecore::DepthMaps* maps_of(int node) const;

  // Draws the maps of a frame. `job`: what passes share, with the frame, grid and pattern of none. Counters and passes
  // are added to `result` later, by finish().
  void render(const scene::FrameGeometry& frame, const tilecore::TileJob& job, WorkRecorder& recorder,
              WorkProgress* progress, int number, FrameResult& result);
  // Of all maps of that frame, for tiles that look them up; only with tile.rendering_elimination.
  std::uint64_t signature() const { return signature_; }
  // What the pixel shader reads; null where no light of the frame casts. Of the frame rendered last.
  const tilecore::FrameShadows* shadows() const { return shadows_ ? &*shadows_ : nullptr; }
  bool any_pass() const { return !results_.empty(); }
  // Maps of which the passes stored anything; until finish().
  std::vector<const tilecore::DepthMaps*> stored() const;
  // Adds the counters of the passes to those of the view, and puts them before its own passes.
  void finish(FrameResult& result);

 private:
  struct Slot {
    int node;
    struct Layer {
      std::unique_ptr<Pipeline> pipeline;
      InputSignatures inputs{};
      std::optional<int> kept{};  // the frame whose depths it holds
    };
    std::vector<Layer> layers;
  };
  const GpuConfiguration& gpu_;
  const RunSettings& settings_;
  std::vector<Slot> slots_;
  std::vector<tilecore::DepthMaps> maps_;  // as slots_
  std::vector<std::vector<scene::LightView>> views_;
  std::optional<tilecore::FrameShadows> shadows_;
  std::vector<FrameResult> results_;
  std::vector<std::size_t> slot_of_;  // as results_
  std::uint64_t signature_ = 0;
};

}  // namespace tessera::gpu
