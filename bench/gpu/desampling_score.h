#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/image_codec.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"

namespace tessera::bench {

// Settings in the form of --set.
using Sets = std::vector<std::string>;

// Frames [first, last) of a shipped capture.
struct Shot {
  std::string name;
  int first, last;
  int width, height;
};

scene::Capture read_shipped(const std::string& name);
// `images`: also keeps the images of the resolve unit and of its error.
gpu::Device renderer_of(const scene::Capture& capture, const Shot& shot, const Sets& sets, bool images = false);

// Displayed values between 0 and 1.
Image shown(const Image8& display);
double rmse(const Image& a, const Image& b);

// The frames with every pixel shaded.
struct Reference {
  std::vector<Image8> display;
  std::vector<Image> linear;  // kept only on request
  std::vector<std::uint64_t> invocations;
};
Reference render_reference(const scene::Capture& capture, const Shot& shot, bool keep_linear = false);

// Bit-identical frames count as this many dB in a mean of PSNR, so that they cannot raise it without bound.
inline constexpr double kIdenticalDecibel = 60;

struct Score {
  std::vector<double> frame_psnr, frame_saved;
  double saved = 0;           // share of the reference's pixel-shader invocations, over all frames
  double psnr = 0;            // mean over frames
  double ssim = 0, flip = 0;  // means over every sixth frame: they take longer than rendering
  // The resolve unit's share of the processor time of tile cores, and of all rendering.
  double resolve_of_tiles = 0, resolve_of_frame = 0;

  double worst_psnr() const;
};
// Renders the shot with these settings and compares it with the reference, frame by frame.
Score score(const scene::Capture& capture, const Shot& shot, const Sets& sets, const Reference& reference);

// resolve.desampling=adaptive and further settings.
Sets adaptive(Sets more = {});
// The three thresholds of speed.
Sets speeds(double reuse, double half_rate, double quarter_rate);

// ---- Parts of tessera_desampling_curves ---------------------------------------------------------------------------

// Measures flicker that full shading does not have. For each pair of consecutive frames, FLIP (Andersson et al. 2020)
// compares the change from one to the next with the change under full shading, as 1/2 + (b - a)/2 of displayed
// values; the result is the mean over pixels and pairs. Comparing changes is the temporal loss of Chaitanya et al.
// 2017 ("Interactive reconstruction of Monte Carlo image sequences using a recurrent denoising autoencoder", section
// 4); its L1 is measured as well. Compares adaptive desampling by thresholds with checkerboard; writes shimmer.csv
// and the ratio at checkerboard's savings.
void shimmer(const std::filesystem::path& folder);

// Writes images that show desampling in frames of stroll and serpent, with eight frames before them as history: rates
// and edges; for one of them the origin of pixels, the images before and after, and their difference.
void desampling_images(const std::filesystem::path& folder);

// Writes crops of scenes that are hard to desample (tests/replay/resolve_faults_test.cpp), 64x48 pixels enlarged four
// times, side by side: fault_*.png. If a setting shows the fault, the images are: with it, by default, fully shaded;
// otherwise: by default, fully shaded, their difference times 16. The crop is where the first image is worst; if they
// are equal, where it has most content.
void desampling_faults(const std::filesystem::path& folder);

}  // namespace tessera::bench
