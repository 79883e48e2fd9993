#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/rect.h"
#include "gpu/bloom.h"
#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "gpu/taa.h"
#include "scene/capture.h"
#include "tilecore/attachment_actions.h"

namespace tessera::gpu {

// A pass that copies an attachment pixel by pixel: a tile loads it and stores it into another one, or into the frame.
struct CopyPass {
  std::string name;
  tilecore::ColorAttachment source;
  tilecore::AttachmentActions actions;  // its load and store
  bool adds_bloom = false;              // adds the graph's bloom to the pixels
};

// The passes that a capture describes, as this machine renders them: one pass that draws all surfaces, along one of the shading
// paths (follow_passes()), some of which have a second pass; temporal antialiasing and a bloom of its colours; and copies that bring
// them into the frame, with or without the bloom. A copy into the frame may be called a
// tone map. If the frame's format holds codes, the store maps the colours, whichever pass they come from; in the pass
// that draws, the tone map is the store. A capture without passes has one, `main`, that draws into the frame. Shadows,
// transmission and the resolve unit add passes of their own when needed.
//
// Invariants (cited by the tests):
//   GRA1  A pass that draws into the frame and overrides nothing gives the images, bytes and cycles of a capture without
//         passes.
//   GRA2  Loads and stores that a capture asks for change bytes and cycles alone.
//   GRA3  An attachment that is loaded or stored raw moves width x height x bytes of a pixel, rounded up to bursts as a whole;
//         a compressed one (frame_buffer.compression) moves its blocks and headers as a frame buffer of its format does.
//         `frame` moves the bursts in which the rows or, compressed, the blocks of a tile lie, as they are in memory.
//   GRA4  A tone map in the last subpass of the drawing pass moves nothing: a capture without passes has the same image,
//         bytes and cycles.
//   GRA5  Passes that name a shading path give the images, bytes and cycles of a capture without passes for which settings
//         choose the path and the bits of its G-buffer.
class FrameGraph {
 public:
  // `region`: the part of the frame that attachments cover. Throws InputError with the place in the capture's file: for
  // a pass that no tile of the machine holds, for passes and actions that this machine does not render, and for actions
  // that would change the image. Throws UsageError for desampling with copies, and, if there is a bloom or temporal
  // antialiasing, for settings that omit pixels it needs: a `region` smaller than `frame`, and rendering elimination; temporal
  // antialiasing also refuses shading.path=gbuffer_external.
  FrameGraph(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings, IntRect region,
             const std::array<int, 2>& frame);

  // Name of the pass that draws; with a G-buffer in memory it fills that, and the pass light_name() stores the colours.
  const std::string& name() const { return name_; }
  // Name of the pass that stores depths alone.
  const std::string& prepass_name() const { return prepass_name_; }
  const std::string& light_name() const { return light_name_; }
  const tilecore::AttachmentActions& actions() const { return actions_; }
  // Copies in the order in which they run, after the passes that draw and light.
  std::span<const CopyPass> copies() const { return copies_; }
  // Temporal antialiasing, behind the pass that draws; nullptr if there is none.
  const Taa* taa() const { return taa_ ? &*taa_ : nullptr; }
  // The bloom, between these and the copies; nullptr if there is none.
  const Bloom* bloom() const { return bloom_ ? &*bloom_ : nullptr; }
  // Attachments of colours that passes store, by number (ColorAttachment::number).
  std::vector<tilecore::ColorAttachment> attachments() const;
  // Whether a pass loads the previous frame from the frame buffer.
  bool loads_frame() const;
  // Memory that attachments take; what else lies with them begins behind it.
  std::uint64_t attachment_bytes() const { return attachment_bytes_; }
  // Whether it moves no more bytes than a capture without passes does.
  bool plain() const { return copies_.empty() && !actions_.any(); }

 private:
  class Reader;

  std::string name_ = "main", prepass_name_ = "prepass", light_name_ = "light";
  tilecore::AttachmentActions actions_;
  std::vector<CopyPass> copies_;
  std::optional<Taa> taa_;
  std::optional<Bloom> bloom_;
  std::uint64_t attachment_bytes_ = 0;
};

}  // namespace tessera::gpu
