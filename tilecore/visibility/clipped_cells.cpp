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

// Pixels of the tile that a triangle may touch.
IntRect touched_pixels(const MicroMesh& m, const std::array<std::size_t, 3>& vertices, bool motion,
                       const scene::Projection& projection, const IntRect& tile) {
  std::array<DVec4, 6> points;
  for (std::size_t k = 0; k < 3; ++k) {
    points[k] = homogeneous(m, vertices[k], false, projection.orthographic);
    points[k + 3] = motion ? homogeneous(m, vertices[k], true, projection.orthographic) : points[k];
  }
  frontend::RoundingMargin margin;
  // The tests below round at the size of the coordinates: 2^-20 is 16 units in the last place.
  for (const DVec4& p : points) {
    margin.position = std::max({margin.position, std::abs(p.x) * 0x1p-20, std::abs(p.y) * 0x1p-20});
    margin.w = std::max(margin.w, std::abs(p.w) * 0x1p-20);
    margin.depth = std::max(margin.depth, std::abs(p.z) * 0x1p-20);
  }
  margin.pixels = 1.0 / static_cast<double>(scene::kSubpixels);
  const auto bounds = frontend::screen_bounds(points, projection, margin);
  if (!bounds) return {};
  const auto pixel = [](float v, int low, int high) {
    return static_cast<int>(std::clamp(std::floor(v), static_cast<float>(low), static_cast<float>(high)));
  };
  return {pixel(bounds->x0, tile.x0, tile.x1), pixel(bounds->y0, tile.y0, tile.y1),
          std::min(pixel(bounds->x1, tile.x0 - 1, tile.x1) + 1, tile.x1),
          std::min(pixel(bounds->y1, tile.y0 - 1, tile.y1) + 1, tile.y1)};
}

}  // namespace

void test_clipped_cells(const MicroMesh& mesh, const TileSamples& samples, TimeRange times, RayEffects effects,
                        const scene::Projection& projection, const VisibilitySettings& settings, HitSink& sink,
                        VisibilityWork& work) {
  constexpr std::array<std::array<std::size_t, 3>, 2> kTriangles = {{{0, 1, 2}, {0, 2, 3}}};
  const HitLimits& limits = settings.limits;
  for (const std::uint32_t cell : mesh.clipped_cells) {
    const std::size_t triangles = mesh.corner[2][cell] != mesh.corner[3][cell] ? 2 : 1;
    for (std::size_t half = 0; half < triangles; ++half) {
      std::array<std::size_t, 3> vertices;
      for (std::size_t k = 0; k < 3; ++k)
        vertices[k] = static_cast<std::size_t>(mesh.corner[kTriangles[half][k]][cell]);
      ++work.box_tests;
      const IntRect box = touched_pixels(mesh, vertices, effects.motion, projection, samples.pixels);
      for (int y = box.y0; y < box.y1; ++y) {
        const std::size_t first = samples.pixels.index(box.x0, y) * static_cast<std::size_t>(samples.spp);
        const auto last = first + static_cast<std::size_t>(box.width() * samples.spp);
        for (std::size_t i = first; i < last; ++i) {
          if (samples.stencil(i) < times.first || samples.stencil(i) > times.last) continue;
          const SampleView s{samples.x[i], samples.y[i], samples.t(i), effects.lens ? samples.lens_u[i] : 0.0f,
                             effects.lens ? samples.lens_v[i] : 0.0f};
          std::array<Corner, 3> c;
          for (std::size_t k = 0; k < 3; ++k) c[k] = place_corner(mesh, vertices[k], s, effects, settings);
          ++work.triangle_tests;
          TriangleHit hit;
          if (!exact_triangle_test(c[0], c[1], c[2], true, hit)) continue;
          if (!(hit.z >= limits.near && hit.z <= limits.far) ||
              !(hit.positive ? limits.keep_positive : limits.keep_negative))
            continue;
          ++work.sample_hits;
          // Such triangles have no place on screen at shutter open; the sample's own serves.
          sink.add({static_cast<std::uint32_t>(i), mesh.triangle[cell] + static_cast<std::uint32_t>(half), hit.z,
                    hit.b1, hit.b2, s.x, s.y});
        }
      }
    }
  }
}

}  // namespace tessera::tilecore
