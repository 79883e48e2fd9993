#include "baselines/immediate.h"

#include <bit>

namespace tessera::baselines {
namespace {

constexpr std::uint64_t kSampleBytes = 4;  // of each surface

int rounded_up_quotient(int a, int b) { return (a + b - 1) / b; }

}  // namespace

SampleLayout::SampleLayout(IntRect region, int samples_per_pixel, std::uint64_t burst_bytes)
    : region_(region),
      samples_per_pixel_(samples_per_pixel),
      samples_per_line_(static_cast<int>(burst_bytes / kSampleBytes)) {
  if (samples_per_pixel >= samples_per_line_) {
    lines_per_pixel_ = rounded_up_quotient(samples_per_pixel, samples_per_line_);
  } else {
    const int bits = std::bit_width(static_cast<unsigned>(samples_per_line_ / samples_per_pixel)) - 1;
    width_ = 1 << (bits + 1) / 2;
    height_ = 1 << bits / 2;
  }
  columns_ = rounded_up_quotient(region.width(), width_);
  line_count_ = static_cast<std::uint32_t>(columns_ * rounded_up_quotient(region.height(), height_) * lines_per_pixel_);
}

void ImmediateMemory::finish(bool resolve) {
  for (std::uint32_t line = 0; resolve && line < drawn_.size(); ++line)
    if (drawn_[line]) use(2 * line + 1, true, false);
  cache_.flush([this](std::uint32_t key) { write_back(key); });
}

}  // namespace tessera::baselines
