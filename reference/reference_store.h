#pragma once

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <span>
#include <string>

#include "base/image.h"
#include "gpu/device.h"
#include "reference/reference_info.h"

namespace tessera::reference {

// Where and when a tradeoff looks, and with what the settings are compared.
struct ReferenceSettings {
  int width = 640, height = 360, frame = 0;
  int samples = 1024;        // per pixel, plain random ones
  double edge_pixels = 1.0;  // target edge length of its grids; 0: the machine's own grids, heights and attributes
  // Decibels of PSNR on display values at which its own noise is small enough to take no more samples; 0: it takes all.
  // The default is 13 dB below the smallest error that a setting of the shipped captures shows (47.0 dB, docs/accuracy_and_stability.md):
  // a twentieth of its square.
  double enough_db = 60.0;
};

// How far a reference is. It may be read while another thread makes it.
struct ReferenceProgress {
  std::atomic<double> done = 0, all = 0;  // samples; `all` is 0 until it can be told
  double share() const { return all > 0 ? std::min(1.0, done / all) : 0; }
};

// How many samples a reference takes whose noise after `made` of them is `psnr_db`: the first of `numbers`, at which it may
// end, that should have `enough_db`. The square of the noise falls as the samples grow.
int expected_samples(std::span<const int> numbers, int made, double psnr_db, double enough_db);

struct Reference {
  Image color;  // linear light
  ReferenceInfo info;
};

// Finest grids that a reference has, in cells along an edge.
inline constexpr int kReferenceMaxFactor = 255;

// The reference of a frame: from DIR/reference/HASH.exr (single precision) and .json where they are, else rendered and
// written there. `inputs` is what else it follows from (the capture's and the program's fingerprints).
Reference get_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                        const gpu::RunSettings& settings, const ReferenceSettings& wanted,
                        const std::filesystem::path& folder, const std::string& inputs,
                        ReferenceProgress* progress = nullptr);

// A reference that is kept whatever program reads it: FOLDER/NAME_FRAME_WIDTHxHEIGHT_HASH.exr (half precision, without loss)
// and .json, HASH being that of the settings. It says what it follows from: `scene` (the fingerprint of the capture), and
// a probe, which is the same frame in 32x18 pixels of one sample. Another scene, shader or renderer gives another probe.
//
// Invariants (cited by the tests):
//   RK1  A kept reference is used exactly while scene and probe are those that it was rendered with.
//   RK2  The image that is given back is the one in the file, whether it was rendered just now or read.
struct KeptReference {
  std::filesystem::path folder;
  std::string name, scene;
};

// `note` is told why a kept reference that is there is old; it is rendered anew and written in its place.
Reference get_kept_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                             const gpu::RunSettings& settings, const ReferenceSettings& wanted,
                             const KeptReference& kept, std::string& note, ReferenceProgress* progress = nullptr);

// An image as a display shows it: exposure, tone map and sRGB curve as write_png's images have them, not rounded to
// 8 bits. What all errors are measured on. First three channels.
Image display_values(const Image& linear, float exposure);

}  // namespace tessera::reference
