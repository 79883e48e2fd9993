// Any bytes as a KTX2 texture, unpacked for one of the targets. Input: a byte that chooses the target, the file.
#include "base/ktx2/ktx2.h"

#include <cstring>
#include <filesystem>

#include "tests/fuzz/fuzz_target.h"
#include "tests/support/captures.h"

namespace tessera::fuzz {
namespace {

namespace fs = std::filesystem;

// Fitting blocks is a search that takes milliseconds a block under the sanitizers: a few dozen of them try it as well as
// a thousand.
constexpr std::uint64_t kMaxPixels = 1 << 14, kMaxFittedPixels = 1 << 9;

void decode(Bytes input) {
  if (input.empty()) return;
  const auto target = static_cast<ktx2::BasisTarget>(input[0] % 2);
  const ImageLimits limits{.max_side = 1 << 12,
                           .max_pixels = target == ktx2::BasisTarget::kRgba32 ? kMaxPixels : kMaxFittedPixels};
  std::uint64_t charged = 0;
  expect_answer([&] {
    ktx2::BasisTexture texture;
    std::string fault;
    const auto charge = [&](std::uint64_t bytes) { charged = bytes; };
    if (!ktx2::decode_ktx2(input.subspan(1), target, limits, texture, fault, charge)) {
      require(!fault.empty(), "a texture is refused without a word");
      return;
    }
    require(!texture.levels.empty() && texture.block_bytes <= 16, "a texture without levels was accepted");
    std::uint64_t bytes = 0;
    for (const ktx2::BasisLevel& level : texture.levels) {
      const auto width = static_cast<std::uint64_t>(level.width), height = static_cast<std::uint64_t>(level.height);
      require(width > 0 && height > 0 && level.texels.size() == 4 * width * height, "a level lacks texels");
      require(level.blocks.size() == (width + 3) / 4 * ((height + 3) / 4) * texture.block_bytes,
              "a level lacks blocks");
      bytes += level.texels.size() + level.blocks.size();
    }
    require(bytes <= charged, "a texture takes more than was charged");
  });
}

std::vector<std::string> textures() {
  std::vector<std::string> all;
  for (const auto& entry : fs::directory_iterator(fs::path(TESSERA_SOURCE_DIR) / "tests" / "base" / "data")) {
    if (entry.path().extension() != ".ktx2") continue;
    const std::string text = test::read_text(entry.path());
    for (const char target : {'\0', '\1'}) all.push_back(target + text);
  }
  return all;
}

// Changes bytes of the head, which has the sizes of everything, or bytes after it; the length stays, so that a file
// with sound sizes gets to the decoders.
std::size_t mutate_texture(std::uint8_t* data, std::size_t size, std::size_t max_size, Generator& random) {
  constexpr std::size_t kHead = 260;
  if (size < kHead + 8 || random() % 16 == 0) return mutate_bytes(data, size, max_size);
  if (random() % 8 == 0) data[0] = static_cast<std::uint8_t>(random());
  const bool head = random() % 6 == 0;
  for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
    const std::size_t at = head ? 13 + random() % (kHead - 13) : kHead + random() % (size - kHead);
    data[at] = random() % 2 == 0 ? static_cast<std::uint8_t>(random())
                                 : static_cast<std::uint8_t>(data[at] ^ (1u << (random() % 8)));
  }
  return size;
}

}  // namespace

const Target kKtx2Target{"ktx2",        "any bytes as a KTX2 texture, for each target", 16 << 10, decode, textures,
                         mutate_texture};

}  // namespace tessera::fuzz
