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

// Parameters of the reference with which a tradeoff compares the settings.
struct ReferenceSettings {
  int width = 640, height = 360, frame = 0;
  int samples = 1024;        // plain random samples per pixel
  double edge_pixels = 1.0;  // target edge length of its grids; 0: the machine's own grids, heights and attributes
  // PSNR on display values, in dB, at which the reference's own noise is small enough to stop; 0: all samples are
  // taken. The default is 13 dB below the smallest error that a setting of the shipped captures shows (47.0 dB,
  // docs/accuracy_and_stability.md): a twentieth of its square.
  double enough_db = 60.0;
};

// Progress of a reference. Other threads may read it while the reference is rendered.
struct ReferenceProgress {
  std::atomic<double> done = 0, all = 0;  // samples; `all` is 0 until it is known
  double share() const { return all > 0 ? std::min(1.0, done / all) : 0; }
};

// Expected number of samples of a reference whose noise after `made` samples is `psnr_db`: the first of `numbers` at
// which it should reach `enough_db`. The square of the noise falls in proportion to the samples.
int expected_samples(std::span<const int> numbers, int made, double psnr_db, double enough_db);

struct Reference {
  Image color;  // linear light
  ReferenceInfo info;
};

// Limit of a reference's grids, in cells along an edge.
inline constexpr int kReferenceMaxFactor = 255;

// The reference of a frame: read from DIR/reference/HASH.exr (single precision) and .json if they exist, else
// rendered and written there. `inputs` identifies its other inputs (the capture's and the program's fingerprints).
Reference get_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                        const gpu::RunSettings& settings, const ReferenceSettings& wanted,
                        const std::filesystem::path& folder, const std::string& inputs,
                        ReferenceProgress* progress = nullptr);

// A reference that outlasts the program that made it: FOLDER/NAME_FRAME_WIDTHxHEIGHT_HASH.exr (half precision,
// without loss) and .json, where HASH identifies the settings. The file records its inputs: `scene` (the fingerprint
// of the capture), and a probe, which is the same frame in 32x18 pixels of one sample. Another scene, shader or
// renderer gives another probe.
//
// Invariants (cited by the tests):
//   RK1  A kept reference is used exactly while scene and probe equal the recorded ones.
//   RK2  The returned image is the one in the file, whether it was just rendered or read.
struct KeptReference {
  std::filesystem::path folder;
  std::string name, scene;
};

// `note` returns why an existing kept reference is outdated; it is then rendered again and replaced.
Reference get_kept_reference(const gpu::PreparedCapture& prepared, const gpu::GpuConfiguration& gpu,
                             const gpu::RunSettings& settings, const ReferenceSettings& wanted,
                             const KeptReference& kept, std::string& note, ReferenceProgress* progress = nullptr);

// An image as a display shows it: exposure, tone map and sRGB curve as in write_png's images, not rounded to 8 bits;
// first three channels. All errors are measured on it.
Image display_values(const Image& linear, float exposure);

}  // namespace tessera::reference
