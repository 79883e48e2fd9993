#include "tests/support/cages.h"
#include "tests/support/tests.h"

namespace tessera::test {

Cage cage_of(std::vector<Vec3> points, std::vector<std::array<int, 4>> faces) {
  std::stable_partition(faces.begin(), faces.end(), [](const auto& face) { return face[3] >= 0; });
  Cage cage;
  scene::Vertices& vertices = cage.primitive.vertices;
  vertices.texcoords.resize(2);
  constexpr std::array<Vec2, 4> kCorners = {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)};
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto first = static_cast<std::uint32_t>(vertices.count());
    const std::size_t size = faces[f][3] >= 0 ? 4 : 3;
    for (std::size_t k = 0; k < size; ++k) {
      vertices.positions.push_back(points[static_cast<std::size_t>(faces[f][k])]);
      vertices.texcoords[0].push_back(kCorners[k]);
      vertices.texcoords[1].push_back({static_cast<float>(f), 0});
    }
    for (const std::uint32_t k : {0u, 1u, 2u}) cage.primitive.indices.push_back(first + k);
    if (size < 4) continue;
    for (const std::uint32_t k : {0u, 2u, 3u}) cage.primitive.indices.push_back(first + k);
    ++cage.rules.quads;
  }
  cage.points = std::move(points);
  cage.faces = std::move(faces);
  return cage;
}

Cage grid_cage(int nx, int ny, float half, std::uint32_t seed) {
  Random random(seed);
  std::vector<Vec3> points;
  for (int y = 0; y <= ny; ++y)
    for (int x = 0; x <= nx; ++x)
      points.emplace_back(static_cast<float>(x), static_cast<float>(y), random.uniform(-half, half));
  std::vector<std::array<int, 4>> faces;
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      const int a = y * (nx + 1) + x, row = nx + 1;
      faces.push_back({a, a + 1, a + row + 1, a + row});
    }
  return cage_of(points, faces);
}

Cage voxel_cage(const std::set<std::array<int, 3>>& cubes, float shift, std::uint32_t seed) {
  std::map<std::array<int, 3>, int> number;
  std::vector<std::array<int, 4>> faces;
  for (const auto& cube : cubes)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        auto beside = cube;
        beside[axis] += side == 1 ? 1 : -1;
        if (cubes.contains(beside)) continue;
        std::array<int, 4> face{};
        for (std::size_t k = 0; k < 4; ++k) {
          auto corner = cube;
          const std::size_t turn = side == 1 ? k : 3 - k;
          corner[axis] += side;
          corner[(axis + 1) % 3] += turn == 1 || turn == 2 ? 1 : 0;
          corner[(axis + 2) % 3] += turn >= 2 ? 1 : 0;
          face[k] = number.emplace(corner, static_cast<int>(number.size())).first->second;
        }
        faces.push_back(face);
      }
  Random random(seed);
  std::vector<Vec3> points(number.size());
  for (const auto& [corner, n] : number)
    points[static_cast<std::size_t>(n)] =
        Vec3(static_cast<float>(corner[0]), static_cast<float>(corner[1]), static_cast<float>(corner[2])) +
        random.in_box(shift);
  return cage_of(points, faces);
}

Cage cube_cage() { return voxel_cage({{0, 0, 0}}); }

Cage bracket_cage(float shift, std::uint32_t seed) {
  return voxel_cage({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, shift, seed);
}

Cage mixed_cage() {
  const Cage cage = bracket_cage();
  std::vector<std::array<int, 4>> faces;
  for (std::size_t f = 0; f < cage.faces.size(); ++f) {
    const auto& q = cage.faces[f];
    if (f % 3 == 0) {
      faces.push_back({q[0], q[1], q[2], -1});
      faces.push_back({q[0], q[2], q[3], -1});
    } else {
      faces.push_back(q);
    }
  }
  return cage_of(cage.points, faces);
}

std::uint32_t vertex_at(const Cage& cage, std::size_t face, std::size_t k) {
  std::size_t first = 0;
  for (std::size_t f = 0; f < face; ++f) first += cage.faces[f][3] >= 0 ? 4 : 3;
  return static_cast<std::uint32_t>(first + k);
}

std::uint32_t vertex_of(const Cage& cage, int point) {
  for (std::size_t f = 0; f < cage.faces.size(); ++f)
    for (std::size_t k = 0; k < 4; ++k)
      if (cage.faces[f][k] == point) return vertex_at(cage, f, k);
  return 0;
}

void add_crease(Cage& cage, const std::vector<int>& points, float sharpness) {
  scene::subdivision::SharpFeature crease{{}, sharpness};
  for (const int p : points) crease.vertices.push_back(vertex_of(cage, p));
  cage.rules.creases.push_back(crease);
}

namespace {

std::array<double, 4> bernstein(double t) {
  const double s = 1 - t;
  return {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
}

std::array<double, 4> bernstein_derivative(double t) {
  const double s = 1 - t;
  return {-3 * s * s, 3 * s * s - 6 * s * t, 6 * s * t - 3 * t * t, 3 * t * t};
}

DVec3 weighted(const Vec3* points, const std::array<double, 4>& bu, const std::array<double, 4>& bv) {
  DVec3 sum(0.0);
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) sum += DVec3(points[4 * j + i]) * (bu[i] * bv[j]);
  return sum;
}

}  // namespace

DVec3 bezier_point(const Vec3* points, double u, double v) { return weighted(points, bernstein(u), bernstein(v)); }

std::array<DVec3, 2> bezier_tangents(const Vec3* points, double u, double v) {
  return {weighted(points, bernstein_derivative(u), bernstein(v)),
          weighted(points, bernstein(u), bernstein_derivative(v))};
}

}  // namespace tessera::test
