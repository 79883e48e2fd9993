#include "scene/weld.h"

#include <bit>
#include <unordered_map>

namespace tessera::scene {
namespace {

std::uint32_t bits_of(float f) { return std::bit_cast<std::uint32_t>(f + 0.0f); }  // -0 and 0 are one

// Calls visit(word) for everything that decides where vertex v goes.
template <class Visit>
void visit_point(const Vertices& vertices, std::size_t v, const Visit& visit) {
  const auto visit3 = [&](const Vec3& p) {
    visit(bits_of(p.x));
    visit(bits_of(p.y));
    visit(bits_of(p.z));
  };
  visit3(vertices.positions[v]);
  if (!vertices.influences.empty())
    for (std::size_t k = 0; k < 8; ++k) {
      const SkinInfluence& influence = vertices.influences[v];
      visit(influence.weights[k] > 0 ? std::uint32_t{influence.joints[k]} : 0u);
      visit(bits_of(influence.weights[k]));
    }
  for (const MorphTarget& target : vertices.morph_targets)
    if (!target.positions.empty()) visit3(target.positions[v]);
}

struct PointHash {
  const Vertices* vertices;
  std::size_t operator()(std::uint32_t v) const {
    std::uint64_t hash = 0xCBF29CE484222325u;
    visit_point(*vertices, v,
                [&](std::uint32_t word) { hash = (hash ^ word) * 0x9E3779B97F4A7C15u, hash ^= hash >> 29; });
    return hash;
  }
};

struct SamePoint {
  const Vertices* vertices;
  bool operator()(std::uint32_t a, std::uint32_t b) const {
    std::vector<std::uint32_t> words;
    visit_point(*vertices, a, [&](std::uint32_t word) { words.push_back(word); });
    std::size_t at = 0;
    bool same = true;
    visit_point(*vertices, b, [&](std::uint32_t word) { same = same && words[at] == word, ++at; });
    return same;
  }
};

}  // namespace

std::vector<std::uint32_t> weld_points(const Vertices& vertices) {
  const std::size_t count = vertices.count();
  std::unordered_map<std::uint32_t, std::uint32_t, PointHash, SamePoint> numbers(count / 2 + 1, PointHash{&vertices},
                                                                                 SamePoint{&vertices});
  std::vector<std::uint32_t> out(count);
  for (std::size_t v = 0; v < count; ++v)
    out[v] = numbers.emplace(static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(numbers.size())).first->second;
  return out;
}

}  // namespace tessera::scene
