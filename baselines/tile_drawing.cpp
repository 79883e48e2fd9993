#include "baselines/tile_drawing.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

#include "baselines/depth_pyramid.h"
#include "baselines/surfaces.h"
#include "tilecore/shading/gbuffer_packing.h"

namespace tessera::baselines {
namespace {

int rounded_up_quotient(int a, int b) { return (a + b - 1) / b; }

}  // namespace

SampleLayout::SampleLayout(IntRect region, int samples_per_pixel, std::uint64_t burst_bytes, std::uint64_t depth_bytes)
    : region_(region),
      samples_per_pixel_(samples_per_pixel),
      samples_per_line_(static_cast<int>(burst_bytes / depth_bytes)) {
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
  const bool lights = data_.gbuffer_words > 0;
  for (std::uint32_t line = 0; resolve && line < drawn_.size(); ++line) {
    if (drawn_[line] && lights) use(key_of(line, kDepth), true, false);
    if (drawn_[line]) use(key_of(line, kColor), true, false);
    if (layered_[line]) use(key_of(line, kLayers), true, false);
  }
  cache_.flush([this](std::uint32_t key) { write_back(key); });
}

namespace {

using scene::AlphaMode;
using Hit = tilecore::HitSink::Hit;

constexpr int kBlockSide = DepthPyramid::kBlockSide;
constexpr std::uint64_t kNoTriangle = ~std::uint64_t{0};

class CollectingSink final : public tilecore::HitSink {
 public:
  void take(std::span<const Hit> hits) override { all.insert(all.end(), hits.begin(), hits.end()); }
  std::vector<Hit> all;
};

// Linear light in 8 bits of a display, the format of such a machine's colour surface.
std::uint32_t packed(const tilecore::ShadedPoint& point) {
  const auto byte = [](float linear) {
    const float c = std::clamp(linear, 0.0f, 1.0f);
    const float coded = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
    return static_cast<std::uint32_t>(std::lround(coded * 255));
  };
  return byte(point.color.x) | byte(point.color.y) << 8 | byte(point.color.z) << 16 |
         static_cast<std::uint32_t>(std::lround(std::clamp(point.alpha, 0.0f, 1.0f) * 255)) << 24;
}

// Depths of samples, and the farthest depth of each block of 8x8 pixels.
class DepthBlocks {
 public:
  // `known`: depths of the samples from the start; empty: they see nothing.
  DepthBlocks(IntRect pixels, int samples_per_pixel, std::span<const float> known)
      : width_(pixels.width()), spp_(samples_per_pixel), columns_((width_ + kBlockSide - 1) / kBlockSide) {
    const auto rows = static_cast<std::size_t>((pixels.height() + kBlockSide - 1) / kBlockSide);
    depth.assign(static_cast<std::size_t>(pixels.width() * pixels.height() * spp_),
                 std::numeric_limits<float>::infinity());
    farthest_.assign(static_cast<std::size_t>(columns_) * rows, std::numeric_limits<float>::infinity());
    changed_.assign(farthest_.size(), !known.empty());
    std::ranges::copy(known, depth.begin());
  }

  std::size_t block_of(std::uint32_t sample) const {
    const int pixel = static_cast<int>(sample) / spp_;
    return static_cast<std::size_t>(pixel / width_ / kBlockSide * columns_ + pixel % width_ / kBlockSide);
  }
  void set(std::uint32_t sample, float z) {
    depth[sample] = z;
    changed_[block_of(sample)] = true;
  }
  float farthest(std::size_t block) {
    if (changed_[block]) {
      changed_[block] = false;
      ++scanned;
      farthest_[block] = scan(static_cast<int>(block));
    }
    return farthest_[block];
  }

  // The farthest depths in the end, block by block, row by row.
  std::vector<float> all_farthest() {
    for (std::size_t block = 0; block < farthest_.size(); ++block) farthest(block);
    return farthest_;
  }

  std::vector<float> depth;
  std::uint64_t scanned = 0;

 private:
  float scan(int block) const {
    const int x0 = block % columns_ * kBlockSide, y0 = block / columns_ * kBlockSide,
              height = static_cast<int>(depth.size()) / spp_ / width_;
    float farthest = 0;
    for (int y = y0; y < std::min(y0 + kBlockSide, height); ++y) {
      const auto row = depth.begin() + (y * width_ + x0) * spp_;
      farthest = std::max(farthest, *std::max_element(row, row + std::min(kBlockSide, width_ - x0) * spp_));
    }
    return farthest;
  }

  int width_, spp_, columns_;
  std::vector<float> farthest_;
  std::vector<bool> changed_;
};

// One tile while it is drawn.
class Drawing {
 public:
  Drawing(const tilecore::TileJob& job, std::uint32_t tile, const SampleLayout& layout, std::span<const float> known)
      : job_(job),
        pixels_(job.grid->pixels(tile)),
        spp_(job.pattern->samples_per_pixel()),
        layout_(layout),
        blocks_(pixels_, spp_, known),
        known_(!known.empty()),
        seen_(blocks_.depth.size(), kNoTriangle) {}

  // Depth test of one base patch's hits, triangle by triangle.
  void draw(std::uint32_t patch, std::uint32_t tile, std::span<Hit> hits, const timing::SubPatchItem& tests) {
    DrawnInTile drawn;
    drawn.patch = patch, drawn.tile = tile;
    drawn.begin = out.touches.size();
    drawn.hits = hits.size();
    drawn.tests = tests;
    const std::size_t invoked = invocations.size(), layers = layers_.size();
    const std::uint64_t scanned = blocks_.scanned, tested = tested_;
    draw_triangles(patch, hits);
    drawn.end = out.touches.size();
    drawn.depth_tests = tested_ - tested;
    drawn.invocations = invocations.size() - invoked;
    drawn.blended = layers_.size() - layers;
    drawn.blocks_scanned = blocks_.scanned - scanned;
    out.drawn.push_back(drawn);
  }

  void draw_triangles(std::uint32_t patch, std::span<Hit> hits) {
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
      return std::tie(a.triangle, a.sample) < std::tie(b.triangle, b.sample);
    });
    for (std::size_t first = 0; first < hits.size();) {
      std::size_t end = first;
      while (end < hits.size() && hits[end].triangle == hits[first].triangle) ++end;
      draw_triangle(patch, hits.subspan(first, end - first));
      first = end;
    }
  }

  void find_visible() {
    out.farthest = blocks_.all_farthest();
    out.visible = seen_;
    if (job_.depths_alone) out.depths = blocks_.depth;
    for (const Layer& layer : layers_)
      if (layer.z < blocks_.depth[layer.sample]) out.visible.push_back(layer.name);
    std::sort(out.visible.begin(), out.visible.end());
    out.visible.erase(std::unique(out.visible.begin(), out.visible.end()), out.visible.end());
    if (!out.visible.empty() && out.visible.back() == kNoTriangle) out.visible.pop_back();
  }

  TileDrawing out;
  std::vector<tilecore::Invocation> invocations;

 private:
  struct Layer {
    std::uint64_t name;
    std::uint32_t sample;
    float z;
  };
  struct SampleTouch {
    std::uint32_t line, bit;
    bool passes;
    std::uint32_t point;
  };

  // Drops hits block by block where the triangle lies behind all samples of a block; returns the remaining hits.
  std::span<Hit> cull_blocks(std::span<Hit> hits) {
    nearest_.clear();
    for (const Hit& hit : hits) {
      const std::size_t block = blocks_.block_of(hit.sample);
      const auto found =
          std::find_if(nearest_.begin(), nearest_.end(), [&](const auto& of) { return of.first == block; });
      if (found == nearest_.end())
        nearest_.emplace_back(block, hit.z);
      else
        found->second = std::min(found->second, hit.z);
    }
    // A surface that reaches a known depth is drawn.
    std::erase_if(nearest_, [&](const auto& of) {
      const float farthest = blocks_.farthest(of.first);
      return of.second < farthest || (known_ && of.second == farthest);
    });
    out.blocks_culled += nearest_.size();
    if (nearest_.empty()) return hits;
    const auto end = std::remove_if(hits.begin(), hits.end(), [&](const Hit& hit) {
      const std::size_t block = blocks_.block_of(hit.sample);
      return std::any_of(nearest_.begin(), nearest_.end(), [&](const auto& of) { return of.first == block; });
    });
    return hits.first(static_cast<std::size_t>(end - hits.begin()));
  }

  bool passes(std::uint32_t patch, const scene::Material& material, const Hit& hit, float t) {
    const float depth = blocks_.depth[hit.sample];
    const bool reaches = known_ && hit.z == depth && material.alpha_mode != AlphaMode::kBlend;
    if (!(hit.z < depth) && !reaches) return false;
    if (material.alpha_mode != AlphaMode::kMask) return true;
    const auto [frame, at] = tilecore::in_segment(
        *job_.frame, {patch, hit.triangle, hit.b1, hit.b2, tilecore::time_seen(*job_.frame, patch, t)});
    const scene::PosedDrawable& drawable = frame.drawable_of(patch);
    if (std::exchange(masked_, &drawable) != &drawable) alpha_test_.begin(frame, drawable);
    return alpha_test_.alpha(at, nullptr) >= material.alpha_cutoff;
  }

  void draw_triangle(std::uint32_t patch, std::span<Hit> all) {
    const scene::Material& material = *job_.frame->drawable_of(patch).material;
    const bool depths_alone = !job_.shades(), blends = material.alpha_mode == AlphaMode::kBlend && !depths_alone;
    touched_.clear();
    std::uint32_t pixel_before = std::numeric_limits<std::uint32_t>::max();
    for (const Hit& hit : cull_blocks(all)) {
      const int sample = static_cast<int>(hit.sample), pixel = sample / spp_;
      const int x = pixels_.x0 + pixel % pixels_.width(), y = pixels_.y0 + pixel / pixels_.width();
      const float t = job_.pattern->t(x, y, sample % spp_);
      ++tested_;
      const bool in_front = passes(patch, material, hit, t);
      if (in_front) {
        const std::uint64_t name = triangle_name(patch, hit.triangle);
        if (blends)
          layers_.push_back({name, hit.sample, hit.z});
        else
          see(hit, name);
        if (!depths_alone && static_cast<std::uint32_t>(pixel) != pixel_before) {
          const float seen_at = tilecore::time_seen(*job_.frame, patch, t);
          invocations.push_back({{patch, hit.triangle, hit.b1, hit.b2, seen_at}, t});
        }
        pixel_before = static_cast<std::uint32_t>(pixel);
      }
      touched_.push_back({layout_.line(x, y, sample % spp_), layout_.place(x, y, sample % spp_), in_front,
                          static_cast<std::uint32_t>(std::max<std::size_t>(invocations.size(), 1) - 1)});
    }
    add_touches(blends);
  }

  // A sample with a known depth sees the first surface that reaches it.
  void see(const Hit& hit, std::uint64_t name) {
    if (!known_) blocks_.set(hit.sample, hit.z);
    if (!known_ || seen_[hit.sample] == kNoTriangle) seen_[hit.sample] = name;
  }

  // Joins the samples of a line, and within it the samples of the same colour.
  void add_touches(bool blends) {
    std::stable_sort(touched_.begin(), touched_.end(), [](const SampleTouch& a, const SampleTouch& b) {
      return std::tie(a.line, a.point) < std::tie(b.line, b.point);
    });
    for (std::size_t k = 0; k < touched_.size();) {
      LineTouch touch{touched_[k].line, false, blends, static_cast<std::uint32_t>(out.writes.size()), 0};
      for (; k < touched_.size() && touched_[k].line == touch.line; ++k) {
        const SampleTouch& of = touched_[k];
        if (!of.passes) continue;
        touch.passes = true;
        if (touch.write_count == 0 || out.writes.back().point != of.point) {
          out.writes.push_back({0, of.point});
          ++touch.write_count;
        }
        out.writes.back().samples |= std::uint64_t{1} << of.bit;
      }
      out.touches.push_back(touch);
    }
  }

  const tilecore::TileJob& job_;
  IntRect pixels_;
  int spp_;
  const SampleLayout& layout_;
  tilecore::AlphaTest alpha_test_;
  const scene::PosedDrawable* masked_ = nullptr;  // drawable whose alpha it tests
  DepthBlocks blocks_;
  bool known_;  // depths do not change
  std::uint64_t tested_ = 0;
  std::vector<std::uint64_t> seen_;
  std::vector<Layer> layers_;
  std::vector<std::pair<std::size_t, float>> nearest_;
  std::vector<SampleTouch> touched_;
};

// The word of the G-buffer, or the colour, that each invocation of a tile leaves.
std::vector<std::uint32_t> words_of(const tilecore::TileJob& job, std::span<const tilecore::Invocation> invocations,
                                    tilecore::PixelShader& shader) {
  std::vector<tilecore::ShadedPoint> points(invocations.size());
  std::vector<std::uint32_t> out;
  const std::size_t words = line_data(job).words();
  if (!job.shading.has_gbuffer()) {
    shader.shade(*job.frame, job.lighting, invocations, points);
    for (const tilecore::ShadedPoint& point : points) out.push_back(packed(point));
    return out;
  }
  shader.fill(*job.frame, job.lighting, invocations, points, nullptr, job.warp_lanes(), nullptr,
              tilecore::halves_of(job.shading));
  out.resize(words * invocations.size());
  for (std::size_t i = 0; i < invocations.size(); ++i) {
    if (shader.filled()[i] == 0) {
      out[words * i] = packed(points[i]);
      continue;
    }
    std::array<float, tilecore::GbufferPlanes::kMaterial> values;
    for (std::size_t plane = 0; plane < values.size(); ++plane) values[plane] = shader.filled_value(plane, i);
    const tilecore::PackedGbuffer code = tilecore::pack_gbuffer(values, 0);
    std::copy_n(code.begin(), words, out.begin() + static_cast<std::ptrdiff_t>(words * i));
  }
  return out;
}

// Shades blended invocations, which fill no G-buffer.
void shade_layers(const tilecore::TileJob& job, std::span<const tilecore::Invocation> invocations,
                  tilecore::PixelShader& shader, std::vector<std::uint32_t>& words) {
  std::vector<tilecore::Invocation> blended;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < invocations.size(); ++i)
    if (job.frame->drawable_of(invocations[i].at.patch).material->alpha_mode == AlphaMode::kBlend)
      blended.push_back(invocations[i]), numbers.push_back(i);
  std::vector<tilecore::ShadedPoint> points(blended.size());
  shader.shade(*job.frame, job.lighting, blended, points);
  const std::size_t of_point = line_data(job).words();
  for (std::size_t k = 0; k < blended.size(); ++k) words[of_point * numbers[k]] = packed(points[k]);
}

}  // namespace

LineData line_data(const tilecore::TileJob& job) {
  const PassSurfaces surfaces = surfaces_of(job);
  LineData data{.color_bursts = surfaces.drawn_bytes() / surfaces.depth_bytes};
  if (surfaces.gbuffer_bytes == 0) return data;
  data.gbuffer_words = std::min<std::size_t>(data.color_bursts, std::tuple_size_v<tilecore::PackedGbuffer>);
  data.layer_bursts = surfaces.color_bytes / surfaces.depth_bytes;
  return data;
}

TileDrawing draw_tile(const tilecore::TileJob& job, std::uint32_t tile, std::vector<binner::ListEntry> entries,
                      const SampleLayout& layout, std::span<const float> known, bool colors, TileDrawer& drawer,
                      std::uint64_t& invocations) {
  // Cells of procedures have no triangles.
  if (job.procedures != nullptr)
    std::erase_if(entries, [&](const binner::ListEntry& entry) {
      return job.frame->drawable_of(entry.base_patch).procedure != nullptr;
    });
  std::sort(entries.begin(), entries.end(),
            [](const binner::ListEntry& a, const binner::ListEntry& b) { return a.base_patch < b.base_patch; });
  Drawing drawing(job, tile, layout, known);
  CollectingSink sink;
  drawer.core.begin_tile(job, tile);
  for (std::size_t e = 0; e < entries.size();) {
    const std::uint32_t patch = entries[e].base_patch;
    sink.all.clear();
    timing::SubPatchItem tests = drawer.core.counted();
    for (std::uint32_t& count : tests.events) count = 0u - count;
    for (; e < entries.size() && entries[e].base_patch == patch; ++e) drawer.core.find_hits(job, entries[e], sink);
    const timing::SubPatchItem after = drawer.core.counted();
    for (std::size_t k = 0; k < tests.events.size(); ++k) tests.events[k] += after.events[k];
    drawing.draw(patch, tile, sink.all, tests);
  }
  drawing.find_visible();
  invocations += drawing.invocations.size();
  if (colors) {
    drawing.out.colors = words_of(job, drawing.invocations, drawer.shader);
    if (job.shading.has_gbuffer()) shade_layers(job, drawing.invocations, drawer.shader, drawing.out.colors);
  }
  return std::move(drawing.out);
}

}  // namespace tessera::baselines
