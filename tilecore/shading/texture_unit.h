#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/counter.h"
#include "memory/line_cache.h"
#include "scene/capture.h"
#include "shaders_cpp/radiance_image.h"
#include "shaders_cpp/texture.h"
#include "tilecore/shading/depth_maps.h"

namespace tessera::tilecore {

// Number of texels of a texture's cache line along one axis: odd * 2^n, where odd is 1, 3 or 5. The line of texel i, i
// / texels, is (i * multiplier) >> shift for i below 2^15; images are no larger (ImageLimits).
struct LineSide {
  int texels;
  std::int32_t multiplier;
  int shift;
  int line_of(int texel) const { return texel * multiplier >> shift; }
};
// The line side for a number of texels whose odd factor is 1, 3 or 5.
LineSide line_side(int texels);

// Layout of the levels of a texture in the emulated memory: each is a rectangle of cache lines, row by row.
struct TextureLayoutView {
  const std::int32_t *first_line, *lines_across;  // by level
  LineSide width, height;                         // of a line
  bool compressed;                                // lookups decode blocks
  const DepthMaps* depths = nullptr;              // the maps that own these lines; nullptr: a texture or an image does
  std::int32_t first_flag = 0;                    // line of the first of its flags
  std::int32_t flags_a_line = 1;
};

// Layout of the textures of a capture in the emulated memory, by numbers of cache lines: one after the other in the
// order of their materials, level by level, each level in rows of lines. A line is a square of the texture's blocks, or
// twice as wide as high: of 64 bytes, 4x4 texels of RGBA8, 2x2 blocks of ASTC, 4x2 blocks of ETC2 without alpha.
//
// Invariants (cited by the tests):
//   TX3  A level of w x h texels in blocks of s x s takes the lines that cover ceil(w/s) x ceil(h/s) blocks, no more.
//   TX4  A line holds line_bytes / block bytes blocks.
class TextureMemory {
 public:
  // `materials`: the materials that frames are drawn with. `images`: further ones that shaders read; an image without
  // levels is ignored. `maps`: of lights, which lie behind the rest.
  TextureMemory(std::span<const scene::Material> materials, std::int64_t line_bytes,
                std::span<const shaders::RadianceImage* const> images = {}, std::span<const DepthMaps> maps = {});

  // Layout of a texture of the materials, of an image, or of maps.
  const TextureLayoutView& layout(const shaders::Texture* texture) const { return layouts_.at(texture).view; }
  const TextureLayoutView& layout(const shaders::RadianceImage* image) const { return layout(image->view()); }
  const TextureLayoutView& layout(const shaders::RadianceView& image) const { return layouts_.at(image.texels).view; }
  const TextureLayoutView& layout(const DepthMaps& maps) const { return layouts_.at(&maps).view; }
  // All lines of an image or of maps.
  memory::LineRange range(const shaders::RadianceImage& image) const { return layouts_.at(image.view().texels).range; }
  memory::LineRange range(const DepthMaps& maps) const { return layouts_.at(&maps).range; }
  std::uint64_t lines() const { return lines_; }
  // The first line of depth maps; all lines from here on belong to them.
  std::uint64_t first_map_line() const { return first_map_line_; }

 private:
  // Adds an image with levels of its own, or the texture of a slot, once each; found by `key`.
  template <class Image>
  void add(const Image& image, const void* key, shaders::TexelBlocks blocks);

  std::int64_t line_bytes_;
  std::uint64_t lines_ = 0, first_map_line_ = 0;
  struct Layout {
    std::vector<std::int32_t> first_line, lines_across;
    TextureLayoutView view{};
    memory::LineRange range;
  };
  std::unordered_map<const void*, Layout> layouts_;
};

// Counters of the texture unit of a core and its texture cache (L1).
struct TextureCounters {
  std::uint64_t texels = 0;
  std::uint64_t texels_decoded = 0;
  std::uint64_t cache_requests = 0;
  std::uint64_t cache_misses = 0;
};

// The memory side of the texture unit of a tile core: the lines that a lookup needs, the lines that the core's cache
// holds, and the lines requested from the L2. (shaders::Texture filters the values.) The cache is emptied before every
// tile, so that a tile's requests do not depend on the earlier tiles of its core. Configured by texture.cache_bytes.
// One instance per thread.
//
// Invariants (cited by the tests):
//   TX1  A warp's lookup requests each line of the texels that its lanes weight once, however many lanes do.
//   TX2  The lines that missed follow from the tile's own lookups alone.
class TextureUnit {
 public:
  struct Settings {
    const TextureMemory* memory = nullptr;  // nullptr: the unit counts nothing
    std::int64_t cache_bytes = 16 << 10, cache_ways = 4, line_bytes = 64;
    bool operator==(const Settings&) const = default;
  };

  // Empties the cache and the list of misses.
  void begin_tile(const Settings& settings);

  // Whether callers must pass lookups to fetch().
  bool active() const { return settings_.memory != nullptr; }
  // A lookup of one invocation.
  void fetch(const shaders::Texture& texture, const shaders::TexelFootprint& footprint);
  // Fetches the lookups of a warp's invocations in one slot, whose texture has this `layout`: lines[4 level +
  // corner][first ... first + lanes), -1 for none. A lane that reads a level has its first corner.
  void fetch_warp(const TextureLayoutView& layout, const std::array<std::int32_t*, 8>& lines, std::size_t first,
                  std::size_t lanes);
  // The same for lookups in depth maps, in one level, of `texels` each: the flags of their tiles, then the lines of
  // stored tiles.
  void fetch_depths(const TextureLayoutView& layout, const std::array<std::int32_t*, 4>& lines, std::size_t first,
                    std::size_t lanes, std::uint64_t texels);
  // The lookup of one lane alone, as in fetch().
  void fetch_lane(const TextureLayoutView& layout, const std::array<std::int32_t*, 8>& lines, std::size_t lane);
  // nullptr: the unit counts nothing.
  const TextureMemory* memory() const { return settings_.memory; }

  // Chooses whether requested lines are kept from now on. Lines among the last four different ones are not kept: a line
  // buffer stands in front of the cache.
  void keep_requests(bool keep) {
    keep_requests_ = keep;
    line_buffer_.fill(kNoLine);
    requests_.clear();
  }
  bool keeps_requests() const { return keep_requests_; }
  std::vector<std::uint32_t> take_requests() { return std::exchange(requests_, {}); }
  std::size_t request_count() const { return requests_.size(); }

  // Lines that missed since begin_tile(), in order.
  const std::vector<std::uint32_t>& misses() const { return misses_; }
  std::vector<std::uint32_t> take_misses() { return std::exchange(misses_, {}); }
  const TextureCounters& counters() const { return counters_; }  // since the last take_counters()
  TextureCounters take_counters() { return std::exchange(counters_, {}); }

 private:
  struct Known {
    const shaders::Texture* texture = nullptr;
    const TextureLayoutView* layout = nullptr;
  };
  const TextureLayoutView& layout_of(const shaders::Texture& texture);
  void keep_request(std::uint32_t line) {
    std::size_t at = 0;
    while (at + 1 < line_buffer_.size() && line_buffer_[at] != line) ++at;
    if (line_buffer_[at] != line) requests_.push_back(line);
    for (; at > 0; --at) line_buffer_[at] = line_buffer_[at - 1];
    line_buffer_[0] = line;
  }
  // Returns false if the current lookup has requested the line before.
  bool ask_once(std::int32_t line);
  void need_line(std::uint32_t line) {
    ++counters_.cache_requests;
    if (keep_requests_) keep_request(line);
    if (cache_.use(line)) return;
    ++counters_.cache_misses;
    misses_.push_back(line);
  }

  Settings settings_;
  memory::LineCache cache_{0, 1, 64};
  std::array<Known, 16> known_;
  std::vector<std::int32_t> candidates_;
  // Lines that the warp's lookup requested in the current level; the first at each place is found without a search.
  struct Asked {
    std::uint64_t lookup = 0;
    std::int32_t line = 0;
  };
  static constexpr std::size_t kAskedPlaces = 128;
  std::array<Asked, kAskedPlaces> asked_at_{};
  std::uint64_t lookup_ = 0;
  std::vector<std::int32_t> asked_;
  std::vector<std::uint32_t> misses_;
  // The newest line first.
  static constexpr std::uint32_t kNoLine = 0xFFFFFFFFu;
  std::array<std::uint32_t, 4> line_buffer_{kNoLine, kNoLine, kNoLine, kNoLine};
  std::vector<std::uint32_t> requests_;
  bool keep_requests_ = false;
  TextureCounters counters_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::TextureCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::TextureCounters> =
    std::to_array<CounterField<tilecore::TextureCounters>>({
        {"texture.texels", &tilecore::TextureCounters::texels, Combine::kSum, "texels",
         "Bilinear or nearest lookups in one level of a texture; a trilinear lookup is two.",
         "MaliTexFiltIssueCy (times texels a cycle); Apple texture limiter"},
        {"texture.texels_decoded", &tilecore::TextureCounters::texels_decoded, Combine::kSum, "texels",
         "Bilinear or nearest lookups of texture.texels in compressed textures.", ""},
        {"texture.cache_requests", &tilecore::TextureCounters::cache_requests, Combine::kSum, "lines",
         "Lines that lookups requested from the texture caches of the cores; each line of a lookup once. With "
         "procedures.mode=published also the lines of geometry images that cells need.",
         ""},
        {"texture.cache_misses", &tilecore::TextureCounters::cache_misses, Combine::kSum, "lines",
         "Requested lines that the caches lack. Caches are emptied before every tile.",
         "MaliSCBusTexL2RdBy (over the line); Adreno % Texture L1 miss; V3D TMU-total-text-cache-miss"},
    });
TESSERA_COUNTERS_COVER(tilecore::TextureCounters);

}  // namespace tessera
