#include "gpu/taa.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "shaders_cpp/taa.h"

namespace tessera::gpu {

bool antialiases(const scene::Capture& capture, const RunSettings& settings) {
  return settings.post.taa > 0 && capture.settings.graph &&
         std::ranges::any_of(capture.settings.graph->passes, [](const scene::Pass& pass) {
           return pass.subpasses[0].shader == scene::PassShader::kTaa;
         });
}

std::array<float, 2> taa_jitter(int frame) {
  const auto halton = [](int index, int base) {
    double value = 0, digit = 1;
    for (; index > 0; index /= base) value += index % base * (digit /= base);
    return static_cast<int>(std::lround(256 * value));
  };
  // The sums of eight points are 912 and 1024: both divide by eight.
  constexpr int kMeanX = 912 / 8, kMeanY = 1024 / 8;
  const int point = frame % kJitteredFrames + 1;
  return {static_cast<float>(halton(point, 2) - kMeanX) / 256.0f,
          static_cast<float>(halton(point, 3) - kMeanY) / 256.0f};
}

tilecore::VelocityAttachment& TaaHistory::begin(int number, const scene::FrameGeometry& geometry, IntRect region) {
  // A frame that does not finish leaves no pose.
  const std::shared_ptr<const scene::FrameGeometry> before = std::exchange(pose_, nullptr);
  const bool follows =
      before != nullptr && number == number_ + 1 && image_.width == region.width() && image_.height == region.height();
  if (!follows) length_ = 0;
  number_ = number;
  motion_ = follows ? std::make_unique<tilecore::MotionField>(geometry, *before) : nullptr;
  velocities_.begin(region, geometry, follows ? before.get() : nullptr, motion_.get());
  before_ = follows ? before : nullptr;
  return velocities_;
}

bool TaaHistory::is_cut() const {
  constexpr int kSide = 3;
  const Image& velocity = velocities_.velocity;
  int outside = 0;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const int x = velocity.width * (2 * i + 1) / (2 * kSide), y = velocity.height * (2 * j + 1) / (2 * kSide);
      const auto v = velocity.at(x, y);
      const float then_x = static_cast<float>(x) + 0.5f - v[0], then_y = static_cast<float>(y) + 0.5f - v[1];
      const bool inside = then_x >= 0 && then_x <= static_cast<float>(velocity.width) && then_y >= 0 &&
                          then_y <= static_cast<float>(velocity.height);
      outside += inside ? 0 : 1;
    }
  return 2 * outside > kSide * kSide;
}

void TaaHistory::resolve(const Taa& taa, Image& color) {
  if (length_ > 0 && is_cut()) length_ = 0;
  ++length_;
  // The mean of the frames so far, until the newest has no more than its share.
  const shaders::TaaSettings settings{std::max(taa.share, 1.0f / static_cast<float>(length_)), true};
  const shaders::TaaImages images{color, velocities_.velocity, taa.depth_bytes > 0 ? &velocities_.depth : nullptr,
                                  image_};
  Image next(color.width, color.height, color.channels);
  parallel_for(static_cast<std::size_t>(color.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < next.width; ++x) {
      const auto from = color.at(x, y);
      const Vec4 pixel =
          length_ == 1 ? Vec4(from[0], from[1], from[2], from[3]) : shaders::taa_pixel(images, settings, x, y);
      const Vec4 stored = taa.history.coder.stored(pixel);
      const auto to = next.at(x, y);
      for (std::size_t c = 0; c < 4; ++c) to[c] = stored[static_cast<int>(c)];
    }
  });
  image_ = std::move(next);
  color = image_;
}

void TaaHistory::end(std::shared_ptr<const scene::FrameGeometry> pose) {
  pose_ = std::move(pose);
  before_.reset();
  motion_.reset();
}

}  // namespace tessera::gpu
