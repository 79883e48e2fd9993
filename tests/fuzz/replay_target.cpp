// Any capture that loads, through the whole machine: a few pixels of its first frame. The first bytes choose machine
// and settings.
#include "base/parallel.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/seeds.h"

namespace tessera::fuzz {
namespace {

constexpr std::size_t kChoices = 4;

template <class Word>
Word choose(std::uint8_t byte, std::initializer_list<Word> words) {
  return *(words.begin() + byte % words.size());
}

gpu::RunSettings settings_of(Bytes choices) {
  using tilecore::Desampling, tilecore::ShadingRate;
  using Path = tilecore::ProcedureSettings::Path;
  gpu::RunSettings settings;
  settings.sampling.samples_per_pixel = choose(choices[0], {1, 4});
  settings.output.machine_model = (choices[0] & 4) != 0;
  settings.effects.motion = (choices[0] & 8) != 0 ? gpu::EffectMode::kOn : gpu::EffectMode::kAuto;
  settings.effects.defocus = (choices[0] & 16) != 0 ? gpu::EffectMode::kOn : gpu::EffectMode::kAuto;
  settings.shading.rate = choose(choices[1], {ShadingRate::kPixel, ShadingRate::kSample, ShadingRate::kCache});
  settings.resolve.desampling =
      choose(choices[1] / 4, {Desampling::kOff, Desampling::kOff, Desampling::kAdaptive, Desampling::kCheckerboard});
  settings.procedures.path = choose(choices[1] / 16, {Path::kSampled, Path::kTessellated});
  return settings;
}

gpu::GpuConfiguration machine_of(Bytes choices) {
  using frontend::BoundMethod;
  using tilecore::VisibilityMethod;
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = choose(choices[2], {8, 16, 32});
  gpu.tilecore.visibility.method =
      choose(choices[2] / 4, {VisibilityMethod::kPatchBvh, VisibilityMethod::kBrute, VisibilityMethod::kSegments,
                              VisibilityMethod::kPartition, VisibilityMethod::kClusters,
                              VisibilityMethod::kClusterPartition, VisibilityMethod::kInterleaved});
  gpu.frontend.bound_method =
      choose(choices[3], {BoundMethod::kNpatch, BoundMethod::kTpatch, BoundMethod::kAabb, BoundMethod::kInterval});
  gpu.tessellator.max_factor = choose(choices[3] / 4, {8, 16});
  gpu.binner.time_segments = choose(choices[3] / 8, {0, 1, 3});
  return gpu;
}

// Work that a fuzzer has no time for: the inputs are small, but a matrix of zeros and a path of a thousand curves are
// small, too.
bool too_much(const scene::Capture& capture) {
  std::size_t vertices = 0, pieces = 0;
  for (const scene::Node& node : capture.nodes)
    if (node.mesh != scene::kNone)
      for (const scene::Primitive& primitive : capture.meshes[static_cast<std::size_t>(node.mesh)].primitives)
        vertices += primitive.vertices.count() + primitive.indices.size();
  for (const scene::Procedure& procedure : capture.procedures) pieces += procedure.pieces.size();
  return vertices > 256 || pieces > 2;
}

void render(Bytes input) {
  if (input.size() <= kChoices) return;
  static const std::filesystem::path kFile = scratch_folder() / "replay.glb";
  write_scratch(kFile, input.subspan(kChoices));
  scene::CaptureLimits limits;
  limits.max_bytes = kMaxBytes;
  limits.image.max_pixels = 1 << 16;
  const ThreadLimit one(1);
  expect_answer([&] {
    const scene::Capture capture = scene::read_capture(kFile, limits);
    if (too_much(capture)) return;
    const gpu::RenderRequest request{20, 12, {0, 0, 20, 12}};
    gpu::Device renderer(capture, machine_of(input), settings_of(input), request);
    const int frame = capture.settings.first_frame;
    const gpu::FrameResult result = renderer.render(frame);
    require(result.targets.color.values.size() >= 20 * 12 * 3, "a frame without all of its pixels");
    if (settings_of(input).resolve.desampling == tilecore::Desampling::kAdaptive) renderer.render(frame + 1);
  });
}

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  unsigned choice = 0;
  for (const std::string& capture : small_captures())
    for (int k = 0; k < 2; ++k) {
      choice = choice * 73 + 41;
      std::string bytes;
      for (std::size_t c = 0; c < kChoices; ++c) bytes.push_back(static_cast<char>((choice >> (5 * c)) & 0xFF));
      all.push_back(bytes + capture);
    }
  return all;
}

std::size_t mutate(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  if (size <= kChoices || random() % 8 == 0) return mutate_bytes(data, size, max_size);
  return kChoices + mutate_capture(data + kChoices, size - kChoices, max_size - kChoices, random);
}

}  // namespace

const Target kReplayTarget{"replay", "any capture that loads, rendered", 16 << 10, render, seeds, mutate};

}  // namespace tessera::fuzz
