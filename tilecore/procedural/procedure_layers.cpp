#include "tilecore/procedural/procedure_layers.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "scene/procedure_patch.h"

namespace tessera::tilecore {
namespace {

constexpr std::uint32_t kWhole = 0x80000000u, kBack = 0x40000000u, kNamed = 0x20000000u;
constexpr int kMaxExponent = 63;
constexpr float kSameDepth = 1.0f / 64;  // share of the depth within which u = 0 and u = 1 may be one place
constexpr float kRegions = 8;            // of a patch along each parameter

// -log2 of a half step, rounded down.
std::uint32_t halvings(float half) {
  int exponent = 0;
  std::frexp(half, &exponent);
  return static_cast<std::uint32_t>(std::clamp(-exponent, 0, kMaxExponent));
}
float half_of(std::uint32_t halvings) { return std::ldexp(1.0f, -static_cast<int>(halvings)); }

// A layer in parameters of the whole procedure.
struct Candidate {
  std::uint32_t sample, drawable;
  bool back;
  float u, v, half_u, half_v;
  std::uint32_t layer, parent;

  auto group() const { return std::tie(sample, drawable, back); }
};

Candidate candidate_of(const scene::FrameGeometry& frame, const TileState::Layer& layer, std::uint32_t number) {
  const scene::ProcedurePatch at = scene::procedure_patch(frame, layer.patch);
  const scene::Procedure::Piece& piece = *at.piece;
  return {layer.sample,
          frame.assembly->patch_drawable[layer.patch],
          (layer.triangle & kBack) != 0,
          piece.u_first + piece.u_scale * at.u(layer.b1),
          piece.v_first + piece.v_scale * at.v(layer.b2),
          piece.u_scale * half_of(layer.triangle >> 8 & 0xFF),
          piece.v_scale * half_of(layer.triangle & 0xFF),
          number,
          number};
}

class LayerMerge {
 public:
  LayerMerge(std::vector<TileState::Layer>& layers, std::vector<Candidate>& candidates)
      : layers_(layers), candidates_(candidates) {}

  // Candidates `first` to `end` form one group.
  void link(std::size_t first, std::size_t end) {
    for (std::size_t a = first; a < end; ++a)
      for (std::size_t b = a + 1; b < end; ++b)
        if (touch(candidates_[a], candidates_[b])) join(a, b);
  }
  // The best of the candidate's set.
  std::size_t root(std::size_t c) {
    while (candidates_[c].parent != c) c = candidates_[c].parent = candidates_[candidates_[c].parent].parent;
    return c;
  }

 private:
  bool touch(const Candidate& a, const Candidate& b) const {
    const float z_a = layers_[a.layer].z, z_b = layers_[b.layer].z;
    const bool wraps = std::abs(z_a - z_b) <= kSameDepth * std::min(z_a, z_b);
    const auto apart = [&](float x, float y) {
      const float d = std::abs(x - y);
      return wraps ? std::min(d, 1.0f - d) : d;
    };
    return apart(a.u, b.u) <= a.half_u + b.half_u && apart(a.v, b.v) <= a.half_v + b.half_v;
  }

  void join(std::size_t a, std::size_t b) {
    a = root(a), b = root(b);
    const auto rank = [&](std::size_t c) {
      const TileState::Layer& layer = layers_[candidates_[c].layer];
      return std::tie(layer.z, layer.patch, layer.b1, layer.b2);
    };
    if (rank(b) < rank(a)) std::swap(a, b);
    candidates_[b].parent = static_cast<std::uint32_t>(a);
  }

  std::vector<TileState::Layer>& layers_;
  std::vector<Candidate>& candidates_;
};

std::uint32_t name_of(const TileState::Layer& layer) {
  const auto region = [](float at) {
    return static_cast<std::uint32_t>(std::clamp(at * kRegions, 0.0f, kRegions - 1));
  };
  return kWhole | kNamed | (layer.triangle & kBack) | region(layer.b1) << 4 | region(layer.b2);
}

}  // namespace

std::uint32_t layer_code(bool back, float half_u, float half_v) {
  return kWhole | (back ? kBack : 0u) | halvings(half_u) << 8 | halvings(half_v);
}

std::size_t merge_procedure_layers(const scene::FrameGeometry& frame, std::vector<TileState::Layer>& layers) {
  std::vector<Candidate> candidates;
  for (std::size_t n = 0; n < layers.size(); ++n)
    if (is_layer_code(layers[n].triangle) && (layers[n].triangle & kNamed) == 0)
      candidates.push_back(candidate_of(frame, layers[n], static_cast<std::uint32_t>(n)));
  if (candidates.empty()) return 0;
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.group() < b.group(); });
  for (std::size_t c = 0; c < candidates.size(); ++c) candidates[c].parent = static_cast<std::uint32_t>(c);
  LayerMerge merge(layers, candidates);
  for (std::size_t first = 0, end = 0; first < candidates.size(); first = end) {
    while (end < candidates.size() && candidates[end].group() == candidates[first].group()) ++end;
    merge.link(first, end);
  }
  std::vector<bool> drops(layers.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    TileState::Layer& layer = layers[candidates[c].layer];
    if (merge.root(c) != c)
      drops[candidates[c].layer] = true;
    else
      layer.triangle = name_of(layer);
  }
  std::size_t kept = 0;
  for (std::size_t n = 0; n < layers.size(); ++n)
    if (!drops[n]) layers[kept++] = layers[n];
  const std::size_t went = layers.size() - kept;
  layers.resize(kept);
  return went;
}

}  // namespace tessera::tilecore
