#include "base/block_encoder.h"

#include <astcenc.h>

#include <algorithm>
#include <new>
#include <span>

#include "base/check.h"
#include "base/ktx2/etc2_fit.h"
#include "base/ktx2/level_writer.h"
#include "base/parallel.h"

namespace tessera {
namespace {

void check_astc(astcenc_error status) {
  if (status == ASTCENC_ERR_OUT_OF_MEM) throw std::bad_alloc();
  TESSERA_CHECK(status == ASTCENC_SUCCESS, astcenc_get_error_string(status));
}

void encode_etc2(bool alpha, ktx2::BasisLevel& level) {
  const ktx2::ContainerLevel size{
      static_cast<std::uint32_t>(level.width), static_cast<std::uint32_t>(level.height), {}, 0};
  ktx2::write_level(size, static_cast<std::size_t>(block_bytes(BlockFormat::kEtc2, alpha)), level,
                    [&](std::size_t index, std::span<std::uint8_t> bytes, ktx2::TexelBlock& texels) {
                      // No other thread reads or writes these texels.
                      const ktx2::TexelBlock wanted =
                          ktx2::get_block(level, index % size.columns(), index / size.columns());
                      texels.fill({0, 0, 0, 255});
                      ktx2::encode_etc2(wanted, bytes, texels);
                    });
}

}  // namespace

int block_side(BlockFormat format) {
  // By format.
  constexpr std::array<int, 8> kSides = {0, 4, 4, 5, 6, 8, 10, 12};
  return kSides[static_cast<std::size_t>(format)];
}

int block_bytes(BlockFormat format, bool alpha) { return format == BlockFormat::kEtc2 && !alpha ? 8 : 16; }

// libastcenc's state for one size of blocks and one profile. Its threads are ours: each takes blocks until none is left.
struct BlockEncoder::Astc {
  Astc(unsigned side, bool srgb) {
    astcenc_config config{};
    // The channels of normals and factors vary independently. They need two planes of weights, which the fast search hardly
    // tries.
    check_astc(astcenc_config_init(srgb ? ASTCENC_PRF_LDR_SRGB : ASTCENC_PRF_LDR, side, side, 1,
                                   srgb ? ASTCENC_PRE_FAST : ASTCENC_PRE_THOROUGH, 0, &config));
    check_astc(astcenc_context_alloc(&config, threads, &context));
  }
  ~Astc() { astcenc_context_free(context); }

  void encode(unsigned side, bool alpha, ktx2::BasisLevel& level) {
    const auto across = [&](int texels) { return (static_cast<std::size_t>(texels) + side - 1) / side; };
    level.blocks.resize(16 * across(level.width) * across(level.height));
    void* rows[] = {level.texels.data()};
    astcenc_image image{static_cast<unsigned>(level.width), static_cast<unsigned>(level.height), 1, ASTCENC_TYPE_U8,
                        rows};
    constexpr astcenc_swizzle kAll{ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B, ASTCENC_SWZ_A},
        kOpaque{ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B, ASTCENC_SWZ_1};
    parallel_for(threads, [&](std::size_t thread) {
      check_astc(astcenc_compress_image(context, &image, alpha ? &kAll : &kOpaque, level.blocks.data(),
                                        level.blocks.size(), static_cast<unsigned>(thread)));
    });
    check_astc(astcenc_compress_reset(context));
    parallel_for(threads, [&](std::size_t thread) {
      check_astc(astcenc_decompress_image(context, level.blocks.data(), level.blocks.size(), &image, &kAll,
                                          static_cast<unsigned>(thread)));
    });
    check_astc(astcenc_decompress_reset(context));
  }

  // kWorkingBytes holds for so many.
  unsigned threads = static_cast<unsigned>(std::min<std::size_t>(thread_count(), 64));
  astcenc_context* context = nullptr;
};

BlockEncoder::BlockEncoder(BlockFormat format, bool srgb) : format_(format) {
  TESSERA_CHECK(format != BlockFormat::kStored, "texels as they are have no blocks");
  if (format != BlockFormat::kEtc2) astc_ = std::make_unique<Astc>(static_cast<unsigned>(block_side(format)), srgb);
}

BlockEncoder::~BlockEncoder() = default;

void BlockEncoder::encode(bool alpha, ktx2::BasisLevel& level) {
  if (astc_ == nullptr)
    encode_etc2(alpha, level);
  else
    astc_->encode(static_cast<unsigned>(block_side(format_)), alpha, level);
}

}  // namespace tessera
