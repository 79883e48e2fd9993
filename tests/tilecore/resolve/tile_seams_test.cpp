// Stencils that stop at a tile's border, on whole images of tiles.
#include "tests/support/tests.h"
#include "tilecore/resolve/cubic_stencil.h"
#include "tilecore/resolve/tile_border.h"

namespace tessera::tilecore::tile_seams_test {
namespace {

constexpr int kSide = 384;

using Shown = std::vector<Vec4>;

Shown filled(const std::function<float(int, int)>& value) {
  Shown image;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) image.emplace_back(Vec3(value(x, y)), 1.0f);
  return image;
}

// White noise of so many pixels a cell, bilinear between cells.
Shown noise(float cell) {
  test::Random random(11);
  constexpr int kCells = 400;
  std::vector<float> grid;
  for (int i = 0; i < kCells * kCells; ++i) grid.push_back(random.uniform(0.1f, 0.7f));
  return filled([&](int x, int y) {
    const float u = (static_cast<float>(x) + 0.5f) / cell, v = (static_cast<float>(y) + 0.5f) / cell;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const float a = u - static_cast<float>(i), b = v - static_cast<float>(j);
    const auto at = [&](int p, int q) { return grid[static_cast<std::size_t>(q % kCells * kCells + p % kCells)]; };
    return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
  });
}

// Root mean square error within two pixels of a border between tiles, over the error of the other pixels.
double seam(const Shown& image, BlockMask pattern, int tile, bool lines) {
  const auto rendered = [&](int x, int y, const IntRect& inside) {
    if (x < inside.x0 || y < inside.y0 || x >= inside.x1 || y >= inside.y1) return false;
    const IntRect block{x & ~3, y & ~3, (x & ~3) + 4, (y & ~3) + 4};
    const BlockMask more = lines ? border_line(pattern, tile_borders(inside, block)) : BlockMask{0};
    return ((pattern | more) >> (4 * (y & 3) + (x & 3)) & 1) != 0;
  };
  double sum[2] = {0, 0}, count[2] = {0, 0};
  for (int by = 64; by < kSide - 64; by += 4)
    for (int bx = 64; bx < kSide - 64; bx += 4) {
      const IntRect inside{bx / tile * tile, by / tile * tile, bx / tile * tile + tile, by / tile * tile + tile};
      const Vec4* first = &image[static_cast<std::size_t>((by - 3) * kSide + bx - 3)];
      BlockWindow window{first, kSide, {}};
      for (int y = 0; y < kWindowSide; ++y)
        for (int x = 0; x < kWindowSide; ++x)
          if (rendered(bx + x - 3, by + y - 3, inside))
            window.usable[static_cast<std::size_t>(y)] =
                static_cast<std::uint16_t>(window.usable[static_cast<std::size_t>(y)] | 1u << x);
      BlockMask missing = 0;
      for (int p = 0; p < 16; ++p)
        if (!rendered(bx + p % 4, by + p / 4, inside)) missing = static_cast<BlockMask>(missing | 1u << p);
      std::array<Vec4, 16> out;
      ReconstructionWork work;
      EXPECT_EQ(reconstruct_block(Reconstruction::kCubic, window, missing, out.data(), work), 0);
      if (lines) {
        EXPECT_EQ(work.direct_pixels, 0u);  // tables have them
      }
      for (int p = 0; p < 16; ++p) {
        const int x = bx + p % 4, y = by + p / 4;
        const bool border = x - inside.x0 < 2 || inside.x1 - x <= 2 || y - inside.y0 < 2 || inside.y1 - y <= 2;
        const double e = missing >> p & 1 ? static_cast<double>(out[static_cast<std::size_t>(p)].x) -
                                                static_cast<double>(image[static_cast<std::size_t>(y * kSide + x)].x)
                                          : 0.0;
        sum[border] += e * e, count[border] += 1;
      }
    }
  return std::sqrt(sum[1] / count[1]) / std::sqrt(sum[0] / count[0]);
}

TEST(TileSeams, BordersAreAsRightAsTheInside) {  // TLB1
  for (const float cell : {1.0f, 2.0f, 3.75f, 5.0f})
    for (const int tile : {8, 16, 32, 64}) {
      const Shown image = noise(cell);
      for (const BlockMask pattern : {kSquareOrder[0], kSquareOrder[1]})
        EXPECT_LE(seam(image, pattern, tile, true), 1.05) << "quarter, " << cell << ", " << tile;
      for (const BlockMask pattern : kPairOrder)
        EXPECT_LE(seam(image, pattern, tile, true), 1.12) << "half, " << cell << ", " << tile;
    }
}

// The failing twin.
TEST(TileSeams, QuartersWithoutLinesShowTheirTiles) { EXPECT_GT(seam(noise(3.75f), kSquareOrder[0], 32, false), 1.3); }

}  // namespace
}  // namespace tessera::tilecore::tile_seams_test
