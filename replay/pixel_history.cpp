#include "replay/pixel_history.h"

#include <map>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "scene/drawable_lookup.h"
#include "tilecore/pixel_ids.h"

namespace tessera::replay {

using tilecore::PixelId;

void PixelHistory::Runs::add(std::uint32_t value) {
  if (values.empty() || values.back() != value) values.push_back(value), lengths.push_back(0);
  ++lengths.back();
}

// Numbers of sub-patches, in the order in which they are seen first.
class PixelHistory::Numbers {
 public:
  Numbers(const scene::Assembly& assembly, std::vector<SubPatch>& sub_patches)
      : assembly_(assembly), sub_patches_(sub_patches) {}

  // Number of the sub-patch plus one.
  std::uint32_t number(const PixelId& id) {
    const Key key{id.patch, id.range.i0, id.range.j0, id.range.i1, id.range.j1};
    if (key == last_key_) return last_;
    const auto [at, fresh] = numbers_.try_emplace(key, static_cast<std::uint32_t>(sub_patches_.size() + 1));
    if (fresh) {
      const std::uint32_t number = drawable(id.patch);
      sub_patches_.push_back({number, id.patch - 1 - assembly_.drawables[number - 1].first_patch, id.range});
    }
    last_key_ = key;
    return last_ = at->second;
  }
  // Number plus one of the drawable of a base patch plus one.
  std::uint32_t drawable(std::uint32_t patch) { return lookup_(assembly_, patch - 1) + 1; }

 private:
  using Key = std::tuple<std::uint32_t, std::uint8_t, std::uint8_t, std::uint8_t, std::uint8_t>;

  const scene::Assembly& assembly_;
  std::vector<SubPatch>& sub_patches_;
  scene::DrawableLookup lookup_;
  std::map<Key, std::uint32_t> numbers_;
  Key last_key_{};
  std::uint32_t last_ = 0;
};

PixelHistory::PixelHistory(const tilecore::FrameTargets& images, const scene::Assembly& assembly)
    : region_(images.region) {
  Numbers numbers(assembly, sub_patches_);
  for (int y = 0; y < images.ids.height; ++y)
    for (int x = 0; x < images.ids.width; ++x) {
      const PixelId id = PixelId::unpacked(images.ids.at(x, y));
      seen_.add(id.patch == 0 ? 0 : numbers.number(id));
      samples_.add(id.samples);
      invocations_.add(id.invocations);
      layers_.add(id.layers);
      nearest_.add(id.nearest_layer == 0 ? 0 : numbers.drawable(id.nearest_layer));
    }
}

std::string PixelHistory::member(const FrameCosts& costs) const {
  if (seen_.values.empty()) return "";
  const auto row = [&](std::uint32_t drawable) {
    const std::optional<std::size_t> found = costs.row_of(drawable);
    return found ? static_cast<int>(*found) : -1;
  };
  const auto runs = [](const Runs& of) {
    return fmt::format("{{\"lengths\": [{}],\n   \"values\": [{}]}}", fmt::join(of.lengths, ","),
                       fmt::join(of.values, ","));
  };
  std::vector<int> rows;
  std::vector<std::uint32_t> patches;
  std::vector<unsigned> cells;
  for (const SubPatch& at : sub_patches_) {
    rows.push_back(row(at.drawable));
    patches.push_back(at.patch);
    for (const std::uint8_t cell : {at.range.i0, at.range.j0, at.range.i1, at.range.j1}) cells.push_back(cell);
  }
  Runs nearest = nearest_;
  for (std::uint32_t& value : nearest.values) value = value == 0 ? 0 : static_cast<std::uint32_t>(row(value) + 1);
  return fmt::format(
      " \"pixels\": {{\"region\": [{}, {}, {}, {}],\n  \"sub_patches\": {{\"row\": [{}],\n   \"patch\": [{}],\n"
      "   \"cells\": [{}]}},\n  \"seen\": {},\n  \"samples\": {},\n  \"invocations\": {},\n  \"layers\": {},\n"
      "  \"nearest_layer\": {}}},\n",
      region_.x0, region_.y0, region_.width(), region_.height(), fmt::join(rows, ","), fmt::join(patches, ","),
      fmt::join(cells, ","), runs(seen_), runs(samples_), runs(invocations_), runs(layers_), runs(nearest));
}

}  // namespace tessera::replay
