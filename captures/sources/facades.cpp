#include "captures/sources/facades.h"

#include <algorithm>

#include "base/random.h"
#include "captures/sources/patterns.h"
#include "captures/sources/surfaces.h"

namespace tessera::captures {
namespace {

// Texture coordinates per metre.
constexpr float kWallScale = 0.5f, kTrimScale = 0.4f;
constexpr int kDoorTile = 6, kShopTile = 7;

// An opening in the wall: cells [column0, column1) x [row0, row1) of its grid.
struct Opening {
  std::size_t column0, column1, row0, row1;
  int tile;  // tile in the atlas of panes
};

// The wall's grid of patches, its lines along edges of windows, doors and floors.
struct WallGrid {
  std::vector<float> x, y;
  std::vector<Opening> openings;

  bool open(std::size_t column, std::size_t row) const {
    return std::any_of(openings.begin(), openings.end(), [&](const Opening& o) {
      return column >= o.column0 && column < o.column1 && row >= o.row0 && row < o.row1;
    });
  }
};

WallGrid wall_grid(const FacadeStyle& s) {
  WallGrid grid;
  const float margin = (s.bay - s.window_width) / 2;
  for (int b = 0; b < s.bays; ++b) {
    const float x = static_cast<float>(b) * s.bay;
    grid.x.insert(grid.x.end(), {x, x + margin, x + margin + s.window_width});
  }
  grid.x.push_back(s.width());
  grid.y = {0.0f, 0.85f, s.ground - 0.95f};
  for (int f = 0; f < s.floors; ++f) {
    const float y = s.ground + static_cast<float>(f) * s.floor;
    grid.y.insert(grid.y.end(), {y, y + s.sill, y + s.sill + s.window_height});
  }
  grid.y.insert(grid.y.end(), {s.height() - 0.7f, s.height()});

  for (int b = 0; b < s.bays; ++b) {
    const auto column = static_cast<std::size_t>(3 * b + 1);
    if (b == s.door)
      grid.openings.push_back({column, column + 1, 0, 2, kDoorTile});
    else if (s.shop && b + 1 < s.bays && b + 1 != s.door && (b == 0 || b == s.door + 1))
      grid.openings.push_back({column, column + 4, 1, 2, kShopTile});
    else if (!grid.open(column, 1))
      grid.openings.push_back({column, column + 1, 1, 2, static_cast<int>(hash32(s.seed, 7, column) % 6)});
    for (int f = 0; f < s.floors; ++f) {
      const auto row = static_cast<std::size_t>(3 * f + 4);
      grid.openings.push_back({column, column + 1, row, row + 1, static_cast<int>(hash32(s.seed, row, column) % 6)});
    }
  }
  return grid;
}

Corner wall_corner(Vec3 at, Vec2 metres, float light) { return {at, metres * kWallScale, Vec3(light)}; }

// Light that reaches the wall at a height: less near the pavement and under the cornice.
float wall_light(float y, float top) {
  return (0.66f + 0.34f * smooth_step(0.0f, 1.8f, y)) * (1.0f - 0.35f * smooth_step(top - 0.5f, top, y));
}

// The wall around its openings, and their reveals; one primitive, so that displaced edges stay together.
void add_wall(Geometry& g, const WallGrid& grid, const FacadeStyle& s) {
  const float top = s.height() - 0.7f, deep = 0.42f;
  for (std::size_t r = 0; r + 1 < grid.y.size(); ++r)
    for (std::size_t c = 0; c + 1 < grid.x.size(); ++c) {
      const float x0 = grid.x[c], x1 = grid.x[c + 1], y0 = grid.y[r], y1 = grid.y[r + 1], z = -s.recess;
      const float low = wall_light(y0, top), high = y1 > top ? 1.0f : wall_light(y1, top);
      if (!grid.open(c, r)) {
        const float bottom = y0 >= top ? 0.95f : low;
        add_patch(g, {wall_corner({x0, y0, 0}, {x0, -y0}, bottom), wall_corner({x1, y0, 0}, {x1, -y0}, bottom),
                      wall_corner({x0, y1, 0}, {x0, -y1}, high), wall_corner({x1, y1, 0}, {x1, -y1}, high)});
        continue;
      }
      if (c > 0 && !grid.open(c - 1, r))
        add_patch(g, {wall_corner({x0, y0, z}, {x0 - z, -y0}, deep * low),
                      wall_corner({x0, y1, z}, {x0 - z, -y1}, deep * high), wall_corner({x0, y0, 0}, {x0, -y0}, low),
                      wall_corner({x0, y1, 0}, {x0, -y1}, high)});
      if (!grid.open(c + 1, r))
        add_patch(g, {wall_corner({x1, y0, z}, {x1 + z, -y0}, deep * low), wall_corner({x1, y0, 0}, {x1, -y0}, low),
                      wall_corner({x1, y1, z}, {x1 + z, -y1}, deep * high), wall_corner({x1, y1, 0}, {x1, -y1}, high)});
      if (r > 0 && !grid.open(c, r - 1))
        add_patch(g, {wall_corner({x0, y0, z}, {x0, z - y0}, 0.6f * low), wall_corner({x0, y0, 0}, {x0, -y0}, low),
                      wall_corner({x1, y0, z}, {x1, z - y0}, 0.6f * low), wall_corner({x1, y0, 0}, {x1, -y0}, low)});
      if (!grid.open(c, r + 1))
        add_patch(
            g,
            {wall_corner({x0, y1, z}, {x0, -y1 - z}, 0.3f * high), wall_corner({x1, y1, z}, {x1, -y1 - z}, 0.3f * high),
             wall_corner({x0, y1, 0}, {x0, -y1}, 0.7f * high), wall_corner({x1, y1, 0}, {x1, -y1}, 0.7f * high)});
    }
}

// Panes reach behind the wall: displaced reveals leave no gap.
void add_pane(Geometry& g, const WallGrid& grid, const Opening& o, float recess) {
  constexpr float kBehind = 0.03f;
  const float x0 = grid.x[o.column0] - kBehind, x1 = grid.x[o.column1] + kBehind, y0 = grid.y[o.row0] - kBehind,
              y1 = grid.y[o.row1] + kBehind, z = -recess;
  // Slightly inside the tile's border, as filters read beyond it.
  const Vec2 low = Vec2(static_cast<float>(o.tile % 4), static_cast<float>(o.tile / 4)) / Vec2(4, 2) + 0.004f,
             high = low + Vec2(0.25f, 0.5f) - 0.008f;
  add_patch(g, {{{{x0, y0, z}, {low.x, high.y}, Vec3(0.9f)},
                 {{x1, y0, z}, high, Vec3(0.9f)},
                 {{x0, y1, z}, low, Vec3(0.5f)},
                 {{x1, y1, z}, {high.x, low.y}, Vec3(0.5f)}}});
}

// Sills, lintels, string courses, corner stones and the cornice.
void add_trim(Geometry& g, const WallGrid& grid, const FacadeStyle& s) {
  for (const Opening& o : grid.openings) {
    const float x0 = grid.x[o.column0], x1 = grid.x[o.column1], y0 = grid.y[o.row0], y1 = grid.y[o.row1];
    if (o.row0 > 0) add_box(g, {x0 - 0.12f, y0 - 0.13f, -0.02f}, {x1 + 0.12f, y0, 0.15f}, kNoBack, kTrimScale);
    if (o.tile != kShopTile) add_box(g, {x0 - 0.10f, y1, -0.02f}, {x1 + 0.10f, y1 + 0.26f, 0.06f}, kNoBack, kTrimScale);
  }
  const float w = s.width(), top = s.height() - 0.7f;
  add_box(g, {-0.02f, s.ground - 0.22f, -0.02f}, {w + 0.02f, s.ground, 0.13f}, kNoBack, kTrimScale);
  for (int step = 0; step < 3; ++step) {
    const float out = 0.12f + 0.13f * static_cast<float>(step), y = top - 0.02f + 0.16f * static_cast<float>(step);
    add_box(g, {-0.02f, y, -0.02f}, {w + 0.02f, y + 0.16f, out}, kNoBack, kTrimScale);
  }
  // Corner stones, long and short in turn.
  int turn = 0;
  for (float y = 0.0f; y + 0.45f < top; y += 0.45f, ++turn) {
    const float reach = turn & 1 ? 0.55f : 0.34f;
    const Vec3 light(wall_light(y + 0.2f, top));
    add_box(g, {0.0f, y + 0.015f, -0.02f}, {reach, y + 0.435f, 0.045f}, kNoBack & ~9u, kTrimScale, light);
    add_box(g, {w - reach, y + 0.015f, -0.02f}, {w, y + 0.435f, 0.045f}, kNoBack & ~10u, kTrimScale, light);
  }
}

// Walls towards the neighbours and the yard, in pieces of about three metres.
void add_sides(Geometry& g, const FacadeStyle& s) {
  const int up = s.floors + 1, along = std::max(1, static_cast<int>(s.depth / 3.0f));
  const float w = s.width(), dy = s.height() / static_cast<float>(up), dz = s.depth / static_cast<float>(along),
              dx = s.bay;
  const auto corner = [](Vec3 p) { return Corner{p, Vec2(p.x + p.z, -p.y) * kWallScale, Vec3(0.9f)}; };
  for (int j = 0; j < up; ++j) {
    const float y0 = dy * static_cast<float>(j), y1 = dy * static_cast<float>(j + 1);
    for (int k = 0; k < along; ++k) {
      const float z0 = -dz * static_cast<float>(k + 1), z1 = -dz * static_cast<float>(k);
      add_patch(g, {corner({0, y0, z0}), corner({0, y0, z1}), corner({0, y1, z0}), corner({0, y1, z1})});
      add_patch(g, {corner({w, y0, z1}), corner({w, y0, z0}), corner({w, y1, z1}), corner({w, y1, z0})});
    }
    for (int b = 0; b < s.bays; ++b) {
      const float x0 = dx * static_cast<float>(b), x1 = dx * static_cast<float>(b + 1), z = -s.depth;
      add_patch(g, {corner({x1, y0, z}), corner({x0, y0, z}), corner({x1, y1, z}), corner({x0, y1, z})});
    }
  }
}

void add_roof(Geometry& g, Geometry& chimneys, const FacadeStyle& s) {
  const float w = s.width(), h = s.height() - 0.25f, rise = s.mansard ? 2.6f : 2.2f,
              back = s.mansard ? 1.3f : s.depth / 2;
  const auto corner = [](float x, float y, float z, float along) {
    return Corner{{x, y, z}, Vec2(x, -along) * kWallScale, Vec3(1.0f)};
  };
  const float slope = glm::length(Vec2(rise, back));
  const float z0 = s.mansard ? -0.1f : -0.35f;
  for (int b = 0; b < s.bays; ++b) {
    const float x0 = s.bay * static_cast<float>(b), x1 = s.bay * static_cast<float>(b + 1);
    add_patch(g, {corner(x0, h, z0, 0), corner(x1, h, z0, 0), corner(x0, h + rise, z0 - back, slope),
                  corner(x1, h + rise, z0 - back, slope)});
    // Behind the ridge: flat behind a mansard, down to the yard otherwise.
    const float y = s.mansard ? h + rise : h;
    add_patch(g, {corner(x0, h + rise, z0 - back, 0), corner(x1, h + rise, z0 - back, 0),
                  corner(x0, y, -s.depth, slope), corner(x1, y, -s.depth, slope)});
  }
  // Gables, not quite pointed, and chimneys at both ends.
  const float ridge = s.mansard ? -s.depth : z0 - back - 0.02f;
  const auto gable = [](float x, float y, float z) { return Corner{{x, y, z}, Vec2(z, -y) * kWallScale, Vec3(0.9f)}; };
  add_patch(chimneys,
            {gable(0, h, -s.depth), gable(0, h, z0), gable(0, h + rise, ridge), gable(0, h + rise, z0 - back)});
  add_patch(chimneys,
            {gable(w, h, z0), gable(w, h, -s.depth), gable(w, h + rise, z0 - back), gable(w, h + rise, ridge)});
  for (const float x : {0.02f, w - 0.72f})
    add_box(chimneys, {x, h - 1.0f, z0 - back - 1.6f}, {x + 0.7f, h + rise + 1.3f, z0 - back + 0.2f}, kNoBottom,
            kWallScale);
}

// An awning over the shop window: a sagging cloth and its front, seen from above and below.
void add_awning(Geometry& g, const WallGrid& grid, const Opening& o) {
  const float x0 = grid.x[o.column0] - 0.15f, x1 = grid.x[o.column1] + 0.15f, y = grid.y[o.row1] + 0.35f;
  const float out[4] = {0.06f, 0.42f, 0.85f, 1.25f}, down[4] = {0.0f, -0.18f, -0.50f, -0.72f};
  const float stripes = (x1 - x0) * 1.4f;
  for (const bool below : {false, true}) {
    std::array<Vec3, 16> cloth, front;
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t i = 0; i < 4; ++i) {
        const float t = static_cast<float>(below ? 3 - i : i) / 3.0f, x = x0 * (1 - t) + x1 * t;
        // v runs up to the wall, so that the upper side is the front of the first.
        cloth[4 * j + i] = {x, y + down[3 - j], out[3 - j]};
        front[4 * j + i] = {x, y + down[3] - 0.28f * (1.0f - static_cast<float>(j) / 3.0f), out[3]};
      }
    const Vec3 light(below ? 0.45f : 1.0f);
    const float a = below ? stripes : 0.0f, b = below ? 0.0f : stripes;
    const std::array<Corner, 4> corners = {
        {{{}, {a, 0.8f}, light}, {{}, {b, 0.8f}, light}, {{}, {a, 0.1f}, light}, {{}, {b, 0.1f}, light}}};
    add_patch(g, cloth, corners, false);
    add_patch(g, front, corners, false);
  }
}

}  // namespace

std::vector<Part> terraced_building(const FacadeStyle& s, const FacadeMaterials& m) {
  const WallGrid grid = wall_grid(s);
  Geometry wall, trim, panes, sides, slates, awnings;
  add_wall(wall, grid, s);
  for (const Opening& o : grid.openings) {
    add_pane(panes, grid, o, o.tile == kShopTile ? 0.5f * s.recess : s.recess);
    if (o.tile == kShopTile) add_awning(awnings, grid, o);
  }
  add_trim(trim, grid, s);
  add_sides(sides, s);
  add_roof(slates, sides, s);
  return {{wall, m.wall}, {trim, m.trim}, {panes, m.panes}, {sides, m.side}, {slates, m.slate}, {awnings, m.awning}};
}

Geometry tower(int bays_x, int bays_z, int floors, float bay, float floor) {
  Geometry g;
  const float x = 0.5f * bay * static_cast<float>(bays_x), z = 0.5f * bay * static_cast<float>(bays_z),
              top = floor * static_cast<float>(floors);
  // Along u around the tower: counter-clockwise seen from above, so that fronts look outwards.
  const Vec2 around[4] = {{-x, z}, {x, z}, {x, -z}, {-x, -z}};
  for (int side = 0; side < 4; ++side) {
    const Vec2 from = around[side], to = around[(side + 1) % 4];
    const int bays = side & 1 ? bays_z : bays_x;
    for (int b = 0; b < bays; ++b)
      for (int f = 0; f < floors; ++f) {
        std::array<Corner, 4> corners;
        for (int k = 0; k < 4; ++k) {
          const int i = b + (k & 1), j = f + k / 2;
          const float t = static_cast<float>(i) / static_cast<float>(bays);
          const Vec2 p = from * (1 - t) + to * t;
          corners[static_cast<std::size_t>(k)] = {{p.x, floor * static_cast<float>(j), p.y},
                                                  Vec2(static_cast<float>(i), static_cast<float>(-j)),
                                                  Vec3(j == 0 ? 0.6f : 1.0f)};
        }
        add_patch(g, corners);
      }
  }
  // The roof lies inside a wall's cell of the texture.
  add_patch(g, {{{{-x, top, z}, {0.02f, 0.02f}},
                 {{x, top, z}, {0.08f, 0.02f}},
                 {{-x, top, -z}, {0.02f, 0.08f}},
                 {{x, top, -z}, {0.08f, 0.08f}}}});
  return g;
}

}  // namespace tessera::captures
