#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/rect.h"
#include "scene/pass_graph.h"
#include "tilecore/attachment_actions.h"
#include "tilecore/resolve/stored_texels.h"

namespace tessera::gpu {

// A step of a bloom, a pass of its own: it makes a level from the image or the level above, or adds the level below to
// a level.
struct BloomStep {
  std::string name;
  std::size_t level;  // that it writes
  bool up;
};

// The bloom of a capture: an attachment with levels, and the steps that fill it. After the last step the largest level
// holds the mean of all levels.
//
// Invariants (cited by the tests):
//   BLP1  A step reads every texel of its sources once and writes its level once. Raw, each texel moves as many bytes as its
//         format has, and a level that halves both sides has a quarter of the bytes of the one above, rounded up to bursts;
//         compressed, its blocks move (stored_arrays.h).
//   BLP2  A step down takes 5 bilinear lookups a texel, a step up 8.
class Bloom {
 public:
  // `source`: the colours of a frame of `width` x `height`. The first level is `scale` times as wide and high.
  Bloom(std::string name, const tilecore::ColorAttachment& source, scene::AttachmentFormat format, double scale,
        int levels, int width, int height);

  const std::string& name() const { return name_; }
  const tilecore::ColorAttachment& source() const { return source_; }
  std::span<const BloomStep> steps() const { return steps_; }
  std::size_t levels() const { return sizes_.size(); }
  std::array<int, 2> size(std::size_t level) const { return sizes_[level]; }
  // The format of a level in memory, and the code of a texel of this red, green and blue light.
  tilecore::TexelFormat texel_format() const;
  tilecore::PixelCode code(std::span<const float> light) const;
  // Base address of a level within the memory of attachments.
  std::uint64_t base(std::size_t level) const { return bases_[level]; }
  // Sets it for the next level, beginning with the first one.
  void place_level(std::uint64_t base) { bases_.push_back(base); }

  // Returns the texels of an image of `size` that `pixels` of the frame own. Every texel has one owner: disjoint pixels own
  // disjoint texels, and the whole frame owns all.
  IntRect part(std::array<int, 2> size, IntRect pixels) const;

  // Runs a step on the host. `frame`: the colours that the first step reads; `images`: one for each level.
  void run(const BloomStep& step, const Image& frame, std::vector<Image>& images) const;

 private:
  std::string name_;
  tilecore::ColorAttachment source_;
  scene::AttachmentFormat format_;
  int width_, height_;
  std::vector<std::uint64_t> bases_;  // by level
  std::vector<std::array<int, 2>> sizes_;
  std::vector<BloomStep> steps_;
};

// Rounds a colour to the nearest value of r11g11b10f or rgba16f, ties to even; larger values become the largest one.
Vec3 rounded_to(scene::AttachmentFormat format, const Vec3& light);

// Mixes the bloom into a finished pixel: `strength` of its light comes from the bloom.
inline Vec3 with_bloom(const Vec3& color, const Vec3& bloom, float strength) {
  return color * (1.0f - strength) + bloom * strength;
}

}  // namespace tessera::gpu
