#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/image_codec.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"

namespace tessera::bench {

// Settings as --set takes them.
using Sets = std::vector<std::string>;

// Frames [first, last) of a shipped capture.
struct Shot {
  std::string name;
  int first, last;
  int width, height;
};

scene::Capture read_shipped(const std::string& name);
// `images`: with those of the resolve unit, and of its error.
gpu::Device renderer_of(const scene::Capture& capture, const Shot& shot, const Sets& sets, bool images = false);

// What a display shows, between 0 and 1.
Image shown(const Image8& display);
double rmse(const Image& a, const Image& b);

// The frames with every pixel shaded.
struct Reference {
  std::vector<Image8> display;
  std::vector<Image> linear;  // kept only where asked for
  std::vector<std::uint64_t> invocations;
};
Reference render_reference(const scene::Capture& capture, const Shot& shot, bool keep_linear = false,
                           const Sets& sets = {});

// Frames that are bit-identical count as this many dB in a mean of PSNR, so that they cannot lift it without bound.
inline constexpr double kIdenticalDecibel = 60;

struct Score {
  std::vector<double> frame_psnr, frame_saved;
  double saved = 0;           // share of the reference's pixel-shader invocations, over all frames
  double psnr = 0;            // mean over frames
  double ssim = 0, flip = 0;  // means over every sixth frame: they take longer than rendering
  double resolve_of_tiles = 0,
         resolve_of_frame =
             0;  // the resolve unit's share of the processor time of tile cores; of all that rendering takes

  double worst_psnr() const;
};
// Renders the shot with these settings and compares it with the reference, frame by frame.
Score score(const scene::Capture& capture, const Shot& shot, const Sets& sets, const Reference& reference);

// resolve.desampling=adaptive and more.
Sets adaptive(Sets more = {});

}  // namespace tessera::bench
