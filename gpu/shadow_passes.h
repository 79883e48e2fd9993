#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gpu/pipeline.h"
#include "gpu/settings.h"
#include "gpu/view_observer.h"
#include "scene/light_views.h"
#include "tilecore/shading/frame_shadows.h"

namespace tessera::gpu {

// The maps of a capture's lights, and the passes that draw them: one for each map, before the passes that look them up.
class ShadowPasses {
 public:
  // All must outlive it. Throws LimitError if more than scene::ShadowRequest::kMaxLights lights cast, BudgetError if
  // their maps take more memory than reading the capture left.
  ShadowPasses(const scene::Assembly& assembly, const frontend::PyramidLibrary& pyramids, const GpuConfiguration& gpu,
               const RunSettings& settings, Pipeline::Cores cores);

  // The maps of all lights that may cast in some frame; empty if no light casts.
  std::span<const tilecore::DepthMaps> maps() const { return maps_; }

  // Shows maps to an observer, with tables of the device that looks them up.
  struct Shown {
    ViewObserver& observer;
    const PatchTable& records;
    const DisplacementMemory* heights;  // nullptr if textures are not modelled
    memory::LineRange map_lines;
  };
  // Draws the maps of the frame number `number`. `view`: the job that will look them up. `result` gets host times;
  // finish() adds counters and passes to it. `shown`: nullptr if there is no observer.
  void render(const tilecore::TileJob& view, WorkRecorder& recorder, WorkProgress* progress, int number,
              FrameResult& result, const Shown* shown = nullptr);
  // One signature of all maps of that frame, an input of every tile that looks them up. Only with
  // tile.rendering_elimination.
  std::uint64_t signature() const { return signature_; }
  // The shadows that the pixel shader looks up in the last rendered frame; nullptr if no light of it casts.
  const tilecore::FrameShadows* shadows() const { return shadows_ ? &*shadows_ : nullptr; }
  bool any_pass() const { return !results_.empty(); }
  // Number of maps drawn in that frame; valid until finish().
  std::size_t count() const { return results_.size(); }
  // The maps in which the passes stored anything; valid until finish().
  std::vector<const tilecore::DepthMaps*> stored() const;
  // Adds the counters of the passes to the view's counters, and puts the passes before the view's own.
  void finish(FrameResult& result);

 private:
  struct Slot {
    int node;
    struct Layer {
      InputSignatures inputs{};
      std::optional<int> kept{};  // the frame whose depths it holds
    };
    int layers_at_once;         // maps of one time
    std::vector<Layer> layers;  // time by time
  };
  // The map that a pass draws into.
  struct Target {
    std::size_t slot;
    int layer;
    binner::TileIndex first_tile;
  };
  void render_map(const tilecore::TileJob& view, const scene::FrameGeometry& moment, const scene::LightView& light,
                  const Target& target, WorkRecorder& recorder, WorkProgress* progress, int number, const Shown* shown);
  const GpuConfiguration& gpu_;
  const frontend::PyramidLibrary& pyramids_;
  const RunSettings& settings_;
  Pipeline pipeline_;
  std::vector<Slot> slots_;
  std::vector<tilecore::DepthMaps> maps_;                          // as slots_
  std::vector<std::vector<std::vector<scene::LightView>>> views_;  // by time and light
  std::optional<tilecore::FrameShadows> shadows_;
  std::vector<FrameResult> results_;
  std::vector<std::size_t> slot_of_;  // as results_
  std::uint64_t signature_ = 0;
};

}  // namespace tessera::gpu
