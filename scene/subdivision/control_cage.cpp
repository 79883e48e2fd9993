#include "scene/subdivision/control_cage.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "scene/weld.h"

namespace tessera::scene::subdivision {
namespace {

template <class... Args>
[[noreturn]] void refuse_cage(fmt::format_string<Args...> format, Args&&... args) {
  throw CageError(fmt::format(format, std::forward<Args>(args)...));
}

constexpr std::uint32_t kNoMate = ~0u;

// A side of a face, from its corner to the next one; sides are numbered like corners.
struct Side {
  std::uint32_t low, high;  // points, low < high
  std::uint32_t corner;
  bool forward;  // runs from low to high
  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
};

class CageBuilder {
 public:
  CageBuilder(const Primitive& primitive, const CageRules& rules)
      : primitive_(primitive), rules_(rules), welded_(weld_points(primitive.vertices)) {}

  ControlCage build() {
    add_faces();
    if (cage_.face_sizes.empty()) refuse_cage("has no face with an area");
    welded_sides_ = sorted_sides(corner_welded_);
    find_mates();
    number_fans();
    check_manifold();
    add_creases();
    add_shared_edges();
    add_corners();
    return std::move(cage_);
  }

 private:
  // ---- Faces ----------------------------------------------------------------------------------------------------

  void add_faces() {
    const std::vector<std::uint32_t>& in = primitive_.indices;
    if (rules_.quads > in.size() / 6)
      refuse_cage("has {} quads, its {} triangles make up to {}", rules_.quads, in.size() / 3, in.size() / 6);
    for (std::size_t q = 0; q < rules_.quads; ++q) {
      const std::uint32_t* t = &in[6 * q];
      if (t[3] != t[0] || t[4] != t[2])
        refuse_cage("quad {} is no pair (a, b, c), (a, c, d): its triangles are ({}, {}, {}) and ({}, {}, {})", q, t[0],
                    t[1], t[2], t[3], t[4], t[5]);
      add_face({t[0], t[1], t[2], t[5]}, 4);
    }
    for (std::size_t i = 6 * rules_.quads; i + 2 < in.size(); i += 3) add_face({in[i], in[i + 1], in[i + 2], 0}, 3);
  }

  void add_face(const std::array<std::uint32_t, 4>& vertices, std::size_t size) {
    std::array<std::uint32_t, 4> kept{};
    std::size_t n = 0;
    for (std::size_t k = 0; k < size; ++k)
      if (welded_[vertices[k]] != welded_[vertices[(k + 1) % size]]) kept[n++] = vertices[k];
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = a + 1; b < n; ++b)
        if (welded_[kept[a]] == welded_[kept[b]]) return;  // folded onto itself
    if (n < 3) return;
    cage_.face_sizes.push_back(static_cast<int>(n));
    face_first_.push_back(static_cast<std::uint32_t>(cage_.corner_vertex.size()));
    for (std::size_t k = 0; k < n; ++k) {
      cage_.corner_vertex.push_back(kept[k]);
      corner_welded_.push_back(welded_[kept[k]]);
      next_.push_back(face_first_.back() + static_cast<std::uint32_t>((k + 1) % n));
    }
  }

  // ---- Points ---------------------------------------------------------------------------------------------------

  // The sides of all faces, sorted so that the sides of one edge are neighbours.
  std::vector<Side> sorted_sides(const std::vector<std::uint32_t>& point_of_corner) const {
    std::vector<Side> sides(next_.size());
    for (std::uint32_t c = 0; c < next_.size(); ++c) {
      const std::uint32_t a = point_of_corner[c], b = point_of_corner[next_[c]];
      sides[c] = {std::min(a, b), std::max(a, b), c, a < b};
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
    });
    return sides;
  }

  // Calls visit(first, last) for the sides of every edge.
  template <class Visit>
  static void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
    for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
      for (last = first + 1; last < sides.size() && sides[last].same_edge(sides[first]);) ++last;
      visit(first, last);
    }
  }

  void find_mates() {
    mate_.assign(next_.size(), kNoMate);
    for_each_edge(welded_sides_, [&](std::size_t first, std::size_t last) {
      if (last - first == 2)
        mate(welded_sides_[first], welded_sides_[first + 1]);
      else if (last - first > 2)
        mate_same_vertices(first, last), find_shared(first, last);
    });
  }

  // Walls that stand on an edge share one curve: the boundary's, which a wall's side has. Sheets that lie on each other
  // need no such edge, because their curves are the same.
  void find_shared(std::size_t first, std::size_t last) {
    std::set<std::set<std::uint32_t>> curves;
    bool boundary = false;
    for (std::size_t s = first; s < last; ++s) {
      const std::uint32_t side = welded_sides_[s].corner;
      if (mate_[side] == kNoMate) {
        boundary = true;
        continue;
      }
      std::set<std::uint32_t> around = face_around(side);
      around.merge(face_around(mate_[side]));
      curves.insert(std::move(around));
    }
    if (curves.size() + (boundary ? 1 : 0) < 2) return;
    for (std::size_t s = first; s < last; ++s)
      if (mate_[welded_sides_[s].corner] != kNoMate) shared_sides_.push_back(welded_sides_[s].corner);
  }

  // Welded points of the face of a corner.
  std::set<std::uint32_t> face_around(std::uint32_t corner) const {
    std::set<std::uint32_t> points;
    for (std::uint32_t c = corner; points.insert(corner_welded_[c]).second;) c = next_[c];
    return points;
  }

  void mate(const Side& a, const Side& b) {
    if (a.forward == b.forward) return;
    mate_[a.corner] = b.corner;
    mate_[b.corner] = a.corner;
  }

  // Sheets that touch (a leaf with a front and a back) often have vertices of their own: two sides that agree on both
  // vertices belong to one sheet.
  void mate_same_vertices(std::size_t first, std::size_t last) {
    const auto vertices = [&](const Side& side) {
      const std::uint32_t a = cage_.corner_vertex[side.corner], b = cage_.corner_vertex[next_[side.corner]];
      return side.forward ? std::pair(a, b) : std::pair(b, a);
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<const Side*>> sheets;
    for (std::size_t s = first; s < last; ++s) sheets[vertices(welded_sides_[s])].push_back(&welded_sides_[s]);
    for (const auto& [ends, sides] : sheets)
      if (sides.size() == 2) mate(*sides[0], *sides[1]);
  }

  // Corners that are joined through sides of two faces get the same point.
  void number_fans() {
    const std::size_t corners = next_.size();
    std::vector<std::uint32_t> parent(corners);
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t c) {
      while (parent[c] != c) c = parent[c] = parent[parent[c]];
      return c;
    };
    for (std::uint32_t c = 0; c < corners; ++c) {
      if (mate_[c] == kNoMate) continue;
      // The side runs a -> b here and b -> a in its mate.
      parent[root(c)] = root(next_[mate_[c]]);
      parent[root(next_[c])] = root(mate_[c]);
    }
    std::vector<int> number(corners, -1);
    std::vector<int> fans(primitive_.vertices.count(), 0);  // per welded point
    corner_point_.resize(corners);
    for (std::uint32_t c = 0; c < corners; ++c) {
      int& point = number[root(c)];
      if (point < 0) {
        point = static_cast<int>(cage_.point_vertex.size());
        cage_.point_vertex.push_back(cage_.corner_vertex[c]);
        ++fans[corner_welded_[c]];
      }
      cage_.face_points.push_back(point);
      corner_point_[c] = static_cast<std::uint32_t>(point);
    }
    split_.assign(cage_.point_vertex.size(), false);
    for (std::size_t p = 0; p < cage_.point_vertex.size(); ++p) {
      if (fans[welded_[cage_.point_vertex[p]]] < 2) continue;
      ++cage_.split_points;
      split_[p] = true;
      cage_.corner_points.push_back(static_cast<int>(p));
      cage_.corner_sharpness.push_back(kInfinitelySharp);
    }
  }

  void check_manifold() const {
    const std::vector<Side> sides = sorted_sides(corner_point_);
    std::vector<std::size_t> valence(cage_.point_vertex.size(), 0);
    for_each_edge(sides, [&](std::size_t first, std::size_t last) {
      const Side& side = sides[first];
      const std::uint32_t a = cage_.point_vertex[side.low], b = cage_.point_vertex[side.high];
      if (last - first > 2)
        refuse_cage("is not a surface: {} faces share the edge of the vertices {} and {}", last - first, a, b);
      if (last - first == 2 && sides[first].forward == sides[first + 1].forward)
        refuse_cage("is not a surface: two faces run the same way through the edge of the vertices {} and {}", a, b);
      for (const std::uint32_t point : {side.low, side.high})
        if (++valence[point] > kMaxValence)
          refuse_cage("has more than {} edges at vertex {}", kMaxValence, cage_.point_vertex[point]);
    });
  }

  // ---- Sharpness ------------------------------------------------------------------------------------------------

  std::uint32_t welded(std::uint32_t vertex, const char* what) const {
    if (vertex >= welded_.size()) refuse_cage("{} vertex {}, there are {}", what, vertex, welded_.size());
    return welded_[vertex];
  }

  void add_creases() {
    for (const SharpFeature& crease : rules_.creases)
      for (std::size_t k = 0; k + 1 < crease.vertices.size(); ++k) {
        const std::uint32_t a = welded(crease.vertices[k], "a crease names"),
                            b = welded(crease.vertices[k + 1], "a crease names");
        const Side wanted{std::min(a, b), std::max(a, b), 0, true};
        auto side = std::lower_bound(
            welded_sides_.begin(), welded_sides_.end(), wanted,
            [](const Side& x, const Side& y) { return std::tie(x.low, x.high) < std::tie(y.low, y.high); });
        if (side == welded_sides_.end() || !side->same_edge(wanted))
          refuse_cage("has a crease between the vertices {} and {}, which no edge joins", crease.vertices[k],
                      crease.vertices[k + 1]);
        for (; side != welded_sides_.end() && side->same_edge(wanted); ++side) {
          cage_.crease_points.push_back(static_cast<int>(corner_point_[side->corner]));
          cage_.crease_points.push_back(static_cast<int>(corner_point_[next_[side->corner]]));
          cage_.crease_sharpness.push_back(crease.sharpness);
        }
      }
  }

  void add_shared_edges() {
    for (const std::uint32_t side : shared_sides_) {
      cage_.crease_points.push_back(static_cast<int>(corner_point_[side]));
      cage_.crease_points.push_back(static_cast<int>(corner_point_[next_[side]]));
      cage_.crease_sharpness.push_back(kInfinitelySharp);
    }
  }

  void add_corners() {
    std::vector<float> sharpness(primitive_.vertices.count(), 0.0f);  // per welded point
    for (const SharpFeature& corner : rules_.corners)
      for (const std::uint32_t vertex : corner.vertices) {
        float& here = sharpness[welded(vertex, "a corner names")];
        here = std::max(here, corner.sharpness);
      }
    for (std::size_t p = 0; p < cage_.point_vertex.size(); ++p) {
      const float s = sharpness[welded_[cage_.point_vertex[p]]];
      if (s == 0 || split_[p]) continue;  // split: infinitely sharp already
      cage_.corner_points.push_back(static_cast<int>(p));
      cage_.corner_sharpness.push_back(s);
    }
  }

  const Primitive& primitive_;
  const CageRules& rules_;
  ControlCage cage_;
  std::vector<std::uint32_t> welded_;         // per vertex of the primitive
  std::vector<std::uint32_t> corner_welded_;  // per corner
  std::vector<std::uint32_t> corner_point_;   // per corner, fans apart
  std::vector<std::uint32_t> face_first_;     // first corner of a face
  std::vector<std::uint32_t> next_;           // next corner of the same face
  std::vector<std::uint32_t> mate_;           // the side of the other face, or kNoMate
  std::vector<std::uint32_t> shared_sides_;   // mated sides of edges that other sheets or walls have, too
  std::vector<Side> welded_sides_;
  std::vector<bool> split_;  // per point: one of several at its place
};

}  // namespace

ControlCage build_cage(const Primitive& primitive, const CageRules& rules) {
  return CageBuilder(primitive, rules).build();
}

}  // namespace tessera::scene::subdivision
