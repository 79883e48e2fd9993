#include "scene/subdivision/limit_masks.h"

#include <cmath>
#include <numbers>

namespace tessera::scene::subdivision {

using std::numbers::pi;

// The surroundings of a point, counter-clockwise: face i between edges i and i + 1. On a boundary there is one edge
// more than faces.
struct LimitMasks::Ring {
  int point;
  std::vector<int> edge, edge_end;  // edges, and at which end of them the point is
  std::vector<int> neighbour;       // the other point of each edge
  std::vector<int> face, face_corner, opposite;

  Ring(const osd::TopologyLevel& level, int p) : point(p) {
    for (const int e : level.GetVertexEdges(p)) {
      const osd::ConstIndexArray ends = level.GetEdgeVertices(e);
      edge.push_back(e);
      edge_end.push_back(ends[0] == p ? 0 : 1);
      neighbour.push_back(ends[0] == p ? ends[1] : ends[0]);
    }
    const osd::ConstIndexArray faces = level.GetVertexFaces(p);
    const osd::ConstLocalIndexArray corners = level.GetVertexFaceLocalIndices(p);
    for (int i = 0; i < faces.size(); ++i) {
      face.push_back(faces[i]);
      face_corner.push_back(corners[i]);
      opposite.push_back(level.GetFaceVertices(faces[i])[(corners[i] + 2) % 4]);
    }
  }
  std::size_t valence() const { return edge.size(); }
  std::size_t edge_after(std::size_t i, std::size_t steps = 1) const { return (i + steps) % edge.size(); }
  std::size_t face_after(std::size_t i, std::size_t steps) const { return (i + steps) % face.size(); }
};

LimitMasks::LimitMasks(const osd::TopologyLevel& level)
    : points_(level.GetNumVertices()),
      edges_(level.GetNumEdges()),
      masks_(static_cast<std::size_t>(points_ + 2 * edges_ + 4 * level.GetNumFaces())),
      sector_valence_(static_cast<std::size_t>(level.GetNumFaces()), {4, 4, 4, 4}) {
  terms_.reserve(masks_.size() * 7);
  for (int p = 0; p < points_; ++p) add_point(level, p);
  for (int f = 0; f < level.GetNumFaces(); ++f) add_inner_masks(level, f);
}

void LimitMasks::add_point(const osd::TopologyLevel& level, int point) {
  const Ring ring(level, point);
  std::vector<std::size_t> sharp;
  for (std::size_t i = 0; i < ring.valence(); ++i)
    if (level.GetEdgeSharpness(ring.edge[i]) > 0 || level.IsEdgeBoundary(ring.edge[i])) sharp.push_back(i);
  // A smooth point of two faces has no tangent plane worth the name; OpenSubdiv takes it for a corner, too.
  if (level.GetVertexSharpness(point) > 0 || sharp.size() > 2 || (sharp.size() < 2 && ring.valence() < 3))
    add_corner_masks(ring);
  else if (sharp.size() == 2)
    add_crease_masks(ring, sharp[0], sharp[1]);
  else
    add_smooth_masks(ring);  // a single sharp edge ends here: a dart has the smooth limit
}

// A third of the way along the edge: the exact end of a cubic B-spline curve, and of a straight line.
void LimitMasks::add_straight_edge(const Ring& ring, std::size_t i) {
  begin(on_edge(ring.edge[i], ring.edge_end[i]));
  add(ring.point, 2.0 / 3.0);
  add(ring.neighbour[i], 1.0 / 3.0);
}

void LimitMasks::add_corner_masks(const Ring& ring) {
  begin(corner(ring.point));
  add(ring.point, 1.0);
  for (std::size_t i = 0; i < ring.valence(); ++i) add_straight_edge(ring, i);
}

// The neighbours are added up before the point: so the sum is the same from whichever end a curve is walked, and a
// wall's boundary has every bit of the crease that it stands on.
void LimitMasks::add_crease_masks(const Ring& ring, std::size_t leading, std::size_t trailing) {
  begin(corner(ring.point));
  add(ring.neighbour[leading], 1.0 / 6.0);
  add(ring.neighbour[trailing], 1.0 / 6.0);
  add(ring.point, 4.0 / 6.0);
  add_straight_edge(ring, leading);
  add_straight_edge(ring, trailing);
  add_sector_masks(ring, leading, trailing - leading);
  const bool interior = ring.face.size() == ring.valence();
  if (interior) add_sector_masks(ring, trailing, ring.valence() - (trailing - leading));
}

// The edges inside a sector of k faces that starts at the leading crease edge: they leave along
// cos(i pi / k) t1 + sin(i pi / k) t2, with the tangents along and across the crease of Biermann et al.
void LimitMasks::add_sector_masks(const Ring& ring, std::size_t leading, std::size_t faces) {
  const auto k = static_cast<double>(faces);
  const double theta = pi / k, c = faces == 2 ? 0.0 : std::cos(theta), s = faces == 2 ? 1.0 : std::sin(theta);
  for (std::size_t j = 0; j < faces; ++j) {
    const std::size_t f = ring.face_after(leading, j);
    sector_valence_[static_cast<std::size_t>(ring.face[f])][static_cast<std::size_t>(ring.face_corner[f])] = 2 * k;
  }
  if (faces < 2) return;
  const double scale = 1.0 / (k * (3.0 + c)), r = (1.0 + c) / s;
  const auto edge = [&](std::size_t j) { return ring.neighbour[ring.edge_after(leading, j)]; };
  const auto across = [&](std::size_t j) {
    return faces == 2 && j == 1 ? 1.0 : j == faces ? 0.0 : std::sin(static_cast<double>(j) * theta);
  };
  for (std::size_t i = 1; i < faces; ++i) {
    const std::size_t here = ring.edge_after(leading, i);
    const double t1 = faces == 2 ? 0.0 : std::cos(static_cast<double>(i) * theta) / 3.0, t2 = across(i) / 3.0;
    begin(on_edge(ring.edge[here], ring.edge_end[here]));
    add(ring.point, 4.0 / 6.0 + t2 * scale * 4.0 * r * (c - 1.0));
    add(edge(0), 1.0 / 6.0 + t1 * 0.5 - t2 * scale * r * (1.0 + 2.0 * c));
    add(edge(faces), 1.0 / 6.0 - t1 * 0.5 - t2 * scale * r * (1.0 + 2.0 * c));
    for (std::size_t j = 0; j < faces; ++j) {
      if (j > 0) add(edge(j), t2 * scale * 4.0 * across(j));
      add(ring.opposite[ring.face_after(leading, j)], t2 * scale * (across(j) + across(j + 1)));
    }
  }
}

void LimitMasks::add_smooth_masks(const Ring& ring) {
  const std::size_t valence = ring.valence();
  const auto n = static_cast<double>(valence);
  const double unit = 1.0 / (n * (n + 5.0));
  begin(corner(ring.point));
  add(ring.point, n * n * unit);
  for (std::size_t j = 0; j < valence; ++j) {
    add(ring.neighbour[j], 4.0 * unit);
    add(ring.opposite[j], unit);
    sector_valence_[static_cast<std::size_t>(ring.face[j])][static_cast<std::size_t>(ring.face_corner[j])] = n;
  }
  // Loop et al. 2009: e = p + 2/3 lambda q, q the tangent along the edge. Midpoints of edges and middles of faces are
  // written out, which leaves the neighbours (weights by_edge cos) and the opposite points (by_face cos).
  const double c = std::cos(pi / n), sigma = 1.0 / std::sqrt(4.0 + c * c);
  const double lambda = (5.0 + std::cos(2.0 * pi / n) + c * std::sqrt(18.0 + 2.0 * std::cos(2.0 * pi / n))) / 16.0;
  const double by_edge = 2.0 / 3.0 * lambda * (1.0 + sigma * c) / n, by_face = 2.0 / 3.0 * lambda * sigma / n;
  for (std::size_t i = 0; i < valence; ++i) {
    begin(on_edge(ring.edge[i], ring.edge_end[i]));
    add(ring.point, n * n * unit);
    for (std::size_t j = 0; j < valence; ++j) {
      const double angle = 2.0 * pi * static_cast<double>((j + valence - i) % valence) / n;
      add(ring.neighbour[j], 4.0 * unit + by_edge * std::cos(angle));
      add(ring.opposite[j], unit + by_face * std::cos(angle + pi / n));
    }
  }
}

// In regular surroundings this is the bicubic B-spline's inner point. A Gregory patch has two inner points at a corner,
// one for each side. We take the mean of the ones whose side has an extraordinary end, so that the outer ring of the
// patches around an extraordinary point still meets its regular neighbours smoothly.
void LimitMasks::add_inner_masks(const osd::TopologyLevel& level, int face) {
  const osd::ConstIndexArray points = level.GetFaceVertices(face), edges = level.GetFaceEdges(face);
  const std::array<double, 4>& valence = sector_valence_[static_cast<std::size_t>(face)];
  for (int k = 0; k < 4; ++k) {
    const double n = valence[static_cast<std::size_t>(k)];
    std::vector<FaceSide> irregular;
    for (const int far : {(k + 1) % 4, (k + 3) % 4}) {
      const int edge = edges[far == (k + 1) % 4 ? k : far];
      const double far_valence = valence[static_cast<std::size_t>(far)];
      const bool smooth = !(level.GetEdgeSharpness(edge) > 0) && !level.IsEdgeBoundary(edge);
      if (smooth && (n != 4 || far_valence != 4)) irregular.push_back({face, k, far, edge, n, far_valence});
    }
    begin(inside(face, k));
    for (const FaceSide& side : irregular) add_gregory_point(level, side, 1.0 / static_cast<double>(irregular.size()));
    if (!irregular.empty()) continue;
    add(points[k], n / (n + 5.0));
    add(points[(k + 1) % 4], 2.0 / (n + 5.0));
    add(points[(k + 3) % 4], 2.0 / (n + 5.0));
    add(points[(k + 2) % 4], 1.0 / (n + 5.0));
  }
}

// Loop et al. 2009: f = (c1 p + (3 - 2 c0 - c1) e + 2 c0 e' + r) / 3, with e and e' the points of the side's curve, c0
// and c1 the cosines of the turn from edge to edge at its ends, and r = 2/3 (middle of this face - middle of the face
// across) + 1/3 (midpoint of the edge ahead - midpoint of the edge behind), in which the side itself cancels.
void LimitMasks::add_gregory_point(const osd::TopologyLevel& level, const FaceSide& side, double weight) {
  const osd::ConstIndexArray points = level.GetFaceVertices(side.face), faces = level.GetEdgeFaces(side.edge);
  const osd::ConstIndexArray across = level.GetFaceVertices(faces[0] == side.face ? faces[1] : faces[0]);
  const int near = points[side.near], far = points[side.far];
  const int ahead = points[(2 * side.near + 4 - side.far) % 4], diagonal = points[(side.near + 2) % 4];
  int behind = 0;
  while (across[behind] != near) ++behind;
  behind = across[(behind + 1) % 4] == far ? (behind + 3) % 4 : (behind + 1) % 4;
  const int opposite = across[(across[(behind + 1) % 4] == near ? behind + 3 : behind + 1) % 4];
  const auto turn = [](double n) { return n == 4 ? 0.0 : std::cos(2.0 * pi / n); };
  const double c0 = turn(side.near_valence), c1 = turn(side.far_valence);
  const int end = level.GetEdgeVertices(side.edge)[0] == near ? 0 : 1;
  weight /= 3.0;
  add_control_point(corner(near), weight * c1);
  add_control_point(on_edge(side.edge, end), weight * (3.0 - 2.0 * c0 - c1));
  add_control_point(on_edge(side.edge, 1 - end), weight * 2.0 * c0);
  add(ahead, weight / 3.0);
  add(across[behind], -weight / 3.0);
  add(diagonal, weight / 6.0);
  add(opposite, -weight / 6.0);
}

std::array<std::size_t, 16> LimitMasks::patch(const osd::TopologyLevel& level, int face) const {
  const osd::ConstIndexArray points = level.GetFaceVertices(face), edges = level.GetFaceEdges(face);
  constexpr std::array<std::size_t, 4> kCorner = {0, 3, 15, 12};  // of the face's points
  constexpr std::array<std::size_t, 4> kInner = {5, 6, 10, 9};
  constexpr std::array<std::array<std::size_t, 2>, 4> kEdge = {
      {{1, 2}, {7, 11}, {14, 13}, {8, 4}}};  // from point k to k + 1
  std::array<std::size_t, 16> out{};
  for (int k = 0; k < 4; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const int first = level.GetEdgeVertices(edges[k])[0] == points[k] ? 0 : 1;
    out[kCorner[at]] = corner(points[k]);
    out[kInner[at]] = inside(face, k);
    out[kEdge[at][0]] = on_edge(edges[k], first);
    out[kEdge[at][1]] = on_edge(edges[k], 1 - first);
  }
  return out;
}

}  // namespace tessera::scene::subdivision
