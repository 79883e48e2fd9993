#include "baselines/tessellated_in_memory.h"

#include <algorithm>
#include <optional>

#include "base/bit_stream.h"

namespace tessera::baselines {
namespace {

// i / n as a fraction of 32 bits; 1 is rounded down to the largest fraction.
std::uint32_t fraction(int i, int n) {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(
      (static_cast<std::uint64_t>(i) << 32) / static_cast<std::uint64_t>(n), ~std::uint32_t{0}));
}

}  // namespace

std::vector<std::uint8_t> encode_tessellation(const TessellatedPatch& patch) {
  std::vector<std::uint8_t> block;
  for (int j = 0; j <= patch.rows; ++j)
    for (int i = 0; i <= patch.columns; ++i)
      put_word(fraction(i, patch.columns), block), put_word(fraction(j, patch.rows), block);
  for (const auto& triangle : patch.triangles)
    for (const std::uint32_t vertex : triangle) put_word(vertex, block);
  return block;
}

void TessellatedInMemoryBinner::add(const TessellatedPatch& patch, const TriangleList& list) {
  if (patch.columns == 0) {
    vertices_.add(patch, list);
    return;
  }
  const std::uint64_t points = patch.x0.size() * Reshading::kDomainPointBytes,
                      indices = patch.triangles.size() * 3 * Reshading::kIndexBytes;
  const std::uint64_t address = vertices_.lists().store_block(encode_tessellation(patch));
  tessellated_.read_bytes += memory::burst_bytes(address, points + indices, burst_bytes_);
  tessellated_.instructions +=
      kPatchInstructions + patch.x0.size() * kPointInstructions + patch.triangles.size() * kTriangleInstructions;
  vertices_.add(patch, list, Reshading::Tessellation{address, address + points});
}

namespace {

class TessellatedInMemory final : public Scheme {
 public:
  void begin(const Pass& pass) override {
    pass_ = &pass;
    binner_.emplace(pass.gpu, *pass.job.grid);
  }
  void add(const DrawnPatch& patch) override { binner_->add(patch.patch, patch.tiles); }
  SchemeResult finish(const DrawnPass& drawn) override {
    binner_->finish(drawn.tile_state_bytes);
    return reference_result(*pass_, drawn, binner_->lists(), false, true, binner_->tessellated());
  }

 private:
  const Pass* pass_ = nullptr;
  std::optional<TessellatedInMemoryBinner> binner_;
};

}  // namespace

std::unique_ptr<Scheme> make_tessellated_in_memory() { return std::make_unique<TessellatedInMemory>(); }

}  // namespace tessera::baselines
