#include "tilecore/visibility/clipped_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "frontend/bounds/screen_bounds.h"
#include "scene/subpixel.h"

namespace tessera::tilecore {
namespace {

struct SampleView {
  float x, y, t, lens_u, lens_v;
};

// The scalar twin of the kernels' place_corner, with the homogeneous form for vertices that are not projected.
Corner place_corner(const MicroMesh& m, std::size_t v, const SampleView& s, RayEffects effects,
                    const VisibilitySettings& settings) {
  Corner c;
  c.z = effects.motion ? std::fma(s.t, m.z1[v] - m.z0[v], m.z0[v]) : m.z0[v];
  if (m.projected[v]) {
    c.scale = settings.orthographic ? 1.0f : 1.0f / c.z;
    c.x = m.x0[v] - s.x;
    c.y = m.y0[v] - s.y;
    if (effects.motion) {
      const float lambda = settings.orthographic ? s.t : s.t * (m.z1[v] / c.z);
      c.x = std::fma(lambda, m.x1[v] - m.x0[v], c.x);
      c.y = std::fma(lambda, m.y1[v] - m.y0[v], c.y);
    }
    if (effects.lens) {
      float coc = settings.orthographic ? 1.0f - c.z * settings.inverse_focus : c.scale - settings.inverse_focus;
      if (std::abs(coc) <= settings.sharp_factor) coc = 0.0f;
      c.x = std::fma(-s.lens_u, coc, c.x);
      c.y = std::fma(-s.lens_v, coc, c.y);
    }
    return c;
  }
  const float x = effects.motion ? std::fma(s.t, m.x1[v] - m.x0[v], m.x0[v]) : m.x0[v];
  const float y = effects.motion ? std::fma(s.t, m.y1[v] - m.y0[v], m.y0[v]) : m.y0[v];
  const float w = settings.orthographic ? 1.0f : c.z;
  // Times w, the lens factor is 1 - z/f in both projections.
  const float coc = effects.lens ? 1.0f - c.z * settings.inverse_focus : 0.0f;
  c.scale = 1.0f;
  c.x = (x - s.x * w) - s.lens_u * coc;
  c.y = (y - s.y * w) - s.lens_v * coc;
  return c;
}

// Homogeneous raster position of a vertex at a key.
DVec4 homogeneous(const MicroMesh& m, std::size_t v, bool close, bool orthographic) {
  const double x = static_cast<double>(close ? m.x1[v] : m.x0[v]), y = static_cast<double>(close ? m.y1[v] : m.y0[v]);
  const double z = static_cast<double>(close ? m.z1[v] : m.z0[v]), w = orthographic ? 1.0 : z;
  return m.projected[v] ? DVec4(x * w, y * w, z, w) : DVec4(x, y, z, w);
}

// Pixels and times at which samples may hit a triangle.
struct Piece {
  IntRect pixels;
  TimeRange values;  // of the stencil
  float near_z;
};

// A triangle without a screen position at some time: bounded over intervals of the shutter in homogeneous coordinates,
// with the part nearer than the near plane cut off.
class ClippedTriangle {
 public:
  ClippedTriangle(const MicroMesh& m, const std::array<std::size_t, 3>& vertices, bool motion,
                  const scene::Projection& projection, const TileSamples& samples, VisibilityWork& work)
      : projection_(projection), samples_(samples), work_(work), motion_(motion) {
    for (std::size_t k = 0; k < 3; ++k) {
      open_[k] = homogeneous(m, vertices[k], false, projection.orthographic);
      close_[k] = motion ? homogeneous(m, vertices[k], true, projection.orthographic) : open_[k];
      // The tests below round at the size of the coordinates: 2^-20 is 16 units in the last place.
      for (const DVec4& p : {open_[k], close_[k]}) {
        margin_.position = std::max({margin_.position, std::abs(p.x) * 0x1p-20, std::abs(p.y) * 0x1p-20});
        margin_.w = std::max(margin_.w, std::abs(p.w) * 0x1p-20);
        margin_.depth = std::max(margin_.depth, std::abs(p.z) * 0x1p-20);
      }
    }
    margin_.pixels = 1.0 / static_cast<double>(scene::kSubpixels);
  }

  // Appends the pieces that a method tests, without pieces that hold no pixel of the tile.
  void append_pieces(const VisibilityMethodSettings& method, const TimeRange& times, std::vector<Piece>& out) const {
    const std::size_t first = out.size();
    switch (motion_ ? method.method : VisibilityMethod::kBrute) {
      case VisibilityMethod::kPatchBvh:
        halve(times, out);
        break;
      case VisibilityMethod::kBrute:
        append(times, out);
        break;
      case VisibilityMethod::kSegments:
      case VisibilityMethod::kClusters:
        append_parts(times, method.stencil_segments > 0 ? method.stencil_segments : kSegments, out);
        break;
      case VisibilityMethod::kInterleaved:
        append_parts(times, 256, out);
        break;
      case VisibilityMethod::kPartition:
      case VisibilityMethod::kClusterPartition:
        append_parts(times, kSegments, out);
        cut_in_space(out, first);
        break;
    }
  }

 private:
  static constexpr int kSegments = 16;      // [assumed] a triangle across the near plane moves far on screen
  static constexpr int kPartSide = 8;       // pixels
  static constexpr double kFewSamples = 2;  // average in a piece: another box costs more than testing them

  // Appends the piece of some stencil values; returns false if no sample has one of them.
  bool append(const TimeRange& values, std::vector<Piece>& out) const {
    const SampleClasses& classes = *samples_.classes;
    const std::uint32_t first = classes.first_at[static_cast<std::size_t>(values.first)],
                        end = classes.first_at[static_cast<std::size_t>(values.last) + 1];
    if (first == end) return false;
    ++work_.box_tests, ++work_.box_lanes;
    std::array<DVec4, 6> points;
    const auto t0 = static_cast<double>(classes.t[first]), t1 = static_cast<double>(classes.t[end - 1]);
    for (std::size_t k = 0; k < 3; ++k) {
      points[k] = open_[k] * (1 - t0) + close_[k] * t0;
      points[k + 3] = open_[k] * (1 - t1) + close_[k] * t1;
    }
    const auto bounds = frontend::screen_bounds(points, projection_, margin_);
    if (!bounds) return false;
    const IntRect& tile = samples_.pixels;
    const auto pixel = [](float v, int low, int high) {
      return static_cast<int>(std::clamp(std::floor(v), static_cast<float>(low), static_cast<float>(high)));
    };
    const IntRect pixels{pixel(bounds->x0, tile.x0, tile.x1), pixel(bounds->y0, tile.y0, tile.y1),
                         std::min(pixel(bounds->x1, tile.x0 - 1, tile.x1) + 1, tile.x1),
                         std::min(pixel(bounds->y1, tile.y0 - 1, tile.y1) + 1, tile.y1)};
    if (pixels.empty()) return false;
    out.push_back({pixels, values, bounds->near_z});
    return true;
  }

  // Halves of the shutter, quarters, and so on, as long as that may spare samples.
  void halve(const TimeRange& values, std::vector<Piece>& out) const {
    if (values.empty() || !append(values, out)) return;
    const Piece& piece = out.back();
    const int count = values.last - values.first + 1;
    const double expected =
        static_cast<double>(piece.pixels.width()) * piece.pixels.height() * samples_.spp * count / 256;
    if (count == 1 || expected <= kFewSamples) return;
    out.pop_back();
    const int middle = values.first + count / 2;
    halve({values.first, middle - 1}, out);
    halve({middle, values.last}, out);
  }

  void append_parts(const TimeRange& times, int count, std::vector<Piece>& out) const {
    for (int k = 0; k < count; ++k) {
      const TimeRange values = TimeRange{256 * k / count, 256 * (k + 1) / count - 1}.intersect(times);
      if (!values.empty()) append(values, out);
    }
  }

  // Squares of the tile instead of the pieces from `first` on; each with the times from the first to the last piece
  // that touches it.
  void cut_in_space(std::vector<Piece>& out, std::size_t first) const {
    std::vector<Piece> parts;
    const IntRect& tile = samples_.pixels;
    for (int y = tile.y0; y < tile.y1; y += kPartSide)
      for (int x = tile.x0; x < tile.x1; x += kPartSide) {
        Piece part{IntRect{x, y, x + kPartSide, y + kPartSide}.intersect(tile), {1, 0}, 0};
        for (std::size_t p = first; p < out.size(); ++p) {
          if (out[p].pixels.intersect(part.pixels).empty()) continue;
          if (part.values.empty()) part.values = out[p].values, part.near_z = out[p].near_z;
          part.values.last = out[p].values.last;
          part.near_z = std::min(part.near_z, out[p].near_z);
        }
        ++work_.box_tests, ++work_.box_lanes;
        if (!part.values.empty()) parts.push_back(part);
      }
    out.resize(first);
    out.insert(out.end(), parts.begin(), parts.end());
  }

  const scene::Projection& projection_;
  const TileSamples& samples_;
  VisibilityWork& work_;
  bool motion_;
  std::array<DVec4, 3> open_, close_;
  frontend::RoundingMargin margin_;
};

// The samples of a piece, natural order numbers: by walking its pixels, or where it has few times by their classes.
template <class Visit>
void for_each_sample(const TileSamples& samples, const Piece& piece, const Visit& visit) {
  const SampleClasses& classes = *samples.classes;
  const std::uint32_t first = classes.first_at[static_cast<std::size_t>(piece.values.first)],
                      end = classes.first_at[static_cast<std::size_t>(piece.values.last) + 1];
  const IntRect& box = piece.pixels;
  const auto spp = static_cast<std::size_t>(samples.spp);
  if (end - first > classes.count / 4) {
    for (int y = box.y0; y < box.y1; ++y) {
      const std::size_t row = samples.pixels.index(box.x0, y) * spp;
      for (std::size_t i = row; i < row + static_cast<std::size_t>(box.width()) * spp; ++i)
        if (samples.stencil(i) >= piece.values.first && samples.stencil(i) <= piece.values.last) visit(i);
    }
    return;
  }
  const int mask = classes.side - 1;
  for (std::uint32_t c = first; c < end; ++c)
    for (int y = box.y0 + ((classes.row[c] - box.y0) & mask); y < box.y1; y += classes.side)
      for (int x = box.x0 + ((classes.column[c] - box.x0) & mask); x < box.x1; x += classes.side)
        visit(samples.pixels.index(x, y) * spp + static_cast<std::size_t>(classes.sample[c]));
}

}  // namespace

void test_clipped_cells(const MicroMesh& mesh, const TileSamples& samples, TimeRange times, RayEffects effects,
                        const scene::Projection& projection, const VisibilitySettings& settings,
                        const VisibilityMethodSettings& method, HitSink& sink, VisibilityWork& work) {
  constexpr std::array<std::array<std::size_t, 3>, 2> kTriangles = {{{0, 1, 2}, {0, 2, 3}}};
  const HitLimits& limits = settings.limits;
  // Hidden samples are skipped only if the method's own boxes have a depth limit, too.
  const float* depth = method.method == VisibilityMethod::kPatchBvh ? settings.depth : nullptr;
  std::vector<Piece> pieces;
  for (const std::uint32_t cell : mesh.clipped_cells) {
    const std::size_t triangles = mesh.corner[2][cell] != mesh.corner[3][cell] ? 2 : 1;
    for (std::size_t half = 0; half < triangles; ++half) {
      std::array<std::size_t, 3> vertices;
      for (std::size_t k = 0; k < 3; ++k)
        vertices[k] = static_cast<std::size_t>(mesh.corner[kTriangles[half][k]][cell]);
      pieces.clear();
      ++work.boxes_built;
      ClippedTriangle(mesh, vertices, effects.motion, projection, samples, work).append_pieces(method, times, pieces);
      for (const Piece& piece : pieces)
        for_each_sample(samples, piece, [&](std::size_t i) {
          if (depth != nullptr && depth[i] < piece.near_z) return;
          const SampleView s{samples.x[i], samples.y[i], samples.t(i), effects.lens ? samples.lens_u[i] : 0.0f,
                             effects.lens ? samples.lens_v[i] : 0.0f};
          std::array<Corner, 3> c;
          for (std::size_t k = 0; k < 3; ++k) c[k] = place_corner(mesh, vertices[k], s, effects, settings);
          ++work.triangle_tests, work.triangle_lanes += VisibilityWork::kTestLanes;
          TriangleHit hit;
          if (!exact_triangle_test(c[0], c[1], c[2], true, hit)) return;
          if (!(hit.z >= limits.near && hit.z <= limits.far) ||
              !(hit.positive ? limits.keep_positive : limits.keep_negative))
            return;
          ++work.sample_hits;
          round_weights(settings.weight_steps, hit.b1, hit.b2);
          // Such triangles have no place on screen at shutter open; the sample's own serves.
          sink.add({static_cast<std::uint32_t>(i), mesh.triangle[cell] + static_cast<std::uint32_t>(half), hit.z,
                    hit.b1, hit.b2, s.x, s.y, hit.positive});
        });
    }
  }
}

}  // namespace tessera::tilecore
