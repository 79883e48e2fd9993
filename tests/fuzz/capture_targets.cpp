// Any bytes as a capture: .glb or .gltf, with files beside it that its URIs may name.
#include <fstream>
#include <iterator>

#include "base/image_codec.h"
#include "scene/capture_reader.h"
#include "tests/fuzz/document_mutator.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/seeds.h"
#include "tests/fuzz/sound_capture.h"
#include "tests/scene/gltf/broken_captures.h"

namespace tessera::fuzz {
namespace {

namespace fs = std::filesystem;

const fs::path& capture_file() {
  static const fs::path kFile = [] {
    const fs::path folder = scratch_folder() / "capture";
    fs::create_directories(folder);
    std::string numbers(512, '\0');
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<char>(i % 61);
    write_scratch(folder / "beside.bin", numbers);
    write_scratch(folder / "beside.png", encode_png(Image8(3, 2, 3)));
    write_scratch(scratch_folder() / "outside.bin", numbers);
    return folder / "capture.glb";
  }();
  return kFile;
}

void read(Bytes input) {
  write_scratch(capture_file(), input);
  scene::CaptureLimits limits;
  limits.max_bytes = kMaxBytes;
  limits.max_file_bytes = kMaxBytes;
  limits.image.max_pixels = kMaxBytes / 8;
  expect_answer([&] {
    const scene::Capture capture = scene::read_capture(capture_file(), limits);
    require_sound(capture);
    if (capture.variants.empty()) return;
    limits.variant = capture.variants.back();
    require_sound(scene::read_capture(capture_file(), limits));
  });
}

std::vector<std::string> seeds() {
  std::vector<std::string> all = small_captures();
  const fs::path folder = scratch_folder() / "seeds";
  for (const test::BrokenClass& broken : test::broken_captures())
    for (const test::BrokenCapture& capture : broken.captures) {
      fs::create_directories(folder);
      const fs::path file = capture.make(folder);
      std::ifstream in(file, std::ios::binary);
      if (fs::is_regular_file(file))
        all.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
      fs::remove_all(folder);
    }
  return all;
}

}  // namespace

const Target kCaptureTarget{"capture", "any bytes as a capture (.glb, .gltf), Draco and images inside it",
                            32 << 10,  read,
                            seeds,     mutate_capture};

}  // namespace tessera::fuzz
