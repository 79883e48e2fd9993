#include "scene/dgf_strip.h"

#include "base/check.h"

namespace tessera::scene {
namespace {

constexpr std::uint8_t kNoTriangle = TriangleAdjacency::kNobody;

bool degenerate(const LocalTriangle& c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; }

LocalTriangle turned(const LocalTriangle& t, std::size_t first) {
  return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
}

class StripWalk {
 public:
  StripWalk(const TriangleAdjacency& triangles, std::span<const std::uint8_t> some, bool third_edge_first)
      : triangles_(triangles), some_(some), third_edge_first_(third_edge_first) {
    open_.fill(false), further_.fill(0);
    for (const std::uint8_t t : some) open_[t] = true;
    for (const std::uint8_t t : some)
      for (std::size_t k = 0; k < 3; ++k)
        if (const std::uint8_t next = triangles.across(t, k); next != kNoTriangle && open_[next]) ++further_[t];
  }

  DgfStrip from(std::uint8_t start) {
    for (; start != kNoTriangle; start = loneliest()) {
      restart(start);
      while (step()) {
      }
    }
    return strip_;
  }

 private:
  struct Place {
    std::uint8_t triangle = kNoTriangle;
    std::uint8_t first = 0;  // the corner at which its first edge begins, over which the strip came
  };

  // The triangle that is still to come across one of the edges of a place, counted from its first; or kNoTriangle.
  std::uint8_t next_across(const Place& at, std::size_t edge) const {
    const std::uint8_t next = triangles_.across(at.triangle, (at.first + edge) % 3);
    return next == kNoTriangle || !open_[next] ? kNoTriangle : next;
  }

  void visit(const Place& place, DgfControl control) {
    open_[place.triangle] = false;
    for (std::size_t k = 0; k < 3; ++k)
      if (const std::uint8_t next = triangles_.across(place.triangle, k); next != kNoTriangle && open_[next])
        --further_[next];
    strip_.order[strip_.count] = place.triangle;
    strip_.corners[strip_.count] = turned(triangles_[place.triangle], place.first);
    strip_.controls[strip_.count++] = control;
  }

  // A strip cannot leave its first triangle across the first edge: it is one without a neighbour where there is any.
  void restart(std::uint8_t start) {
    Place place{start, 0};
    for (std::uint8_t k = 0; k < 3; ++k)
      if (next_across({start, k}, 0) == kNoTriangle) place.first = k;
    ++strip_.restarts;
    visit(place, DgfControl::kRestart);
    before_ = {}, at_ = place;
  }

  bool step() {
    const std::uint8_t second = next_across(at_, 1), third = next_across(at_, 2);
    if (second == kNoTriangle && third == kNoTriangle) return backtrack();
    bool take_third = second == kNoTriangle;
    if (second != kNoTriangle && third != kNoTriangle)
      take_third = further_[third] != further_[second] ? further_[third] < further_[second] : third_edge_first_;
    go(at_, take_third ? 2 : 1, take_third ? DgfControl::kEdge2 : DgfControl::kEdge1);
    return true;
  }

  bool backtrack() {
    const DgfControl control = strip_.controls[strip_.count - 1];
    if (control != DgfControl::kEdge1 && control != DgfControl::kEdge2) return false;
    const std::size_t edge = control == DgfControl::kEdge1 ? 2 : 1;
    if (next_across(before_, edge) == kNoTriangle) return false;
    go(before_, edge, DgfControl::kBacktrack);
    return true;
  }

  void go(const Place& from, std::size_t edge, DgfControl control) {
    const std::uint8_t next = next_across(from, edge), end = triangles_[from.triangle][(from.first + edge + 1) % 3];
    Place place{next, kNoTriangle};
    for (std::uint8_t k = 0; k < 3; ++k)
      if (triangles_.across(next, k) == from.triangle && triangles_[next][k] == end) place.first = k;
    TESSERA_CHECK(place.first != kNoTriangle, "neighbours know each other");
    visit(place, control);
    before_ = at_, at_ = place;
  }

  std::uint8_t loneliest() const {
    std::uint8_t best = kNoTriangle;
    for (const std::uint8_t t : some_)
      if (open_[t] && (best == kNoTriangle || further_[t] < further_[best])) best = t;
    return best;
  }

  const TriangleAdjacency& triangles_;
  std::span<const std::uint8_t> some_;
  bool third_edge_first_;
  std::array<bool, kMaxClusterTriangles> open_;
  std::array<std::uint8_t, kMaxClusterTriangles> further_;  // neighbours that are still to come
  Place before_, at_;
  DgfStrip strip_;
};

}  // namespace

TriangleAdjacency::TriangleAdjacency(std::span<const LocalTriangle> triangles) : triangles_(triangles) {
  TESSERA_CHECK(triangles.size() <= kMaxClusterTriangles, "clusters have at most 124 triangles");
  for (auto& row : across_) row.fill(kNoTriangle);
  for (std::size_t s = 0; s < triangles.size(); ++s)
    for (std::size_t k = 0; k < 3; ++k) match(s, k);
}

void TriangleAdjacency::match(std::size_t s, std::size_t k) {
  if (across_[s][k] != kNoTriangle || degenerate(triangles_[s])) return;
  const std::uint8_t from = triangles_[s][k], to = triangles_[s][(k + 1) % 3];
  for (std::size_t t = s + 1; t < triangles_.size(); ++t)
    for (std::size_t j = 0; j < 3; ++j)
      if (triangles_[t][j] == to && triangles_[t][(j + 1) % 3] == from && across_[t][j] == kNoTriangle &&
          !degenerate(triangles_[t])) {
        across_[s][k] = static_cast<std::uint8_t>(t);
        across_[t][j] = static_cast<std::uint8_t>(s);
        return;
      }
}

DgfStrip walk_strip(const TriangleAdjacency& triangles, std::span<const std::uint8_t> some, std::uint8_t start,
                    bool third_edge_first) {
  TESSERA_CHECK(!some.empty() && some.size() <= kDgfMaxTriangles, "strips have 1 to 64 triangles");
  return StripWalk(triangles, some, third_edge_first).from(start);
}

}  // namespace tessera::scene
