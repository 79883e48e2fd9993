#include "scene/gltf/read_ahead.h"

#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <set>
#include <string_view>

#include <nlohmann/json.hpp>

#include "base/parallel.h"
#include "scene/gltf/builders.h"
#include "scene/gltf/meshopt_reader.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";

// Limit on the work ahead that a file may ask for; the builders decode the rest themselves.
constexpr std::size_t kMaxJobs = 1024;

// Things to decode, each for a shelf. All draw on one room.
class Jobs {
 public:
  explicit Jobs(std::uint64_t room) : room_(room), all_(room) {}

  // `decode`(budget) makes the value; it runs on any thread.
  template <class Key, class Value, class Decode>
  void add(Shelf<Key, Value>& shelf, const Key& key, Decode decode) {
    if (jobs_.size() >= kMaxJobs) return;
    jobs_.push_back([this, &shelf, key, decode = std::move(decode)] {
      std::vector<Charge> charges;
      MemoryBudget budget(room_, charges);
      try {
        Value value = decode(budget);
        const std::lock_guard lock(mutex_);
        shelf.put(key, std::move(value), std::move(charges), budget.used_bytes());
      } catch (const std::exception&) {  // RA1: forgotten
        room_ += budget.used_bytes();
      }
    });
  }
  std::size_t count() const { return jobs_.size(); }
  void run() {
    parallel_for(jobs_.size(), [&](std::size_t j) { jobs_[j](); });
    jobs_.clear();
  }
  // Bytes charged for the values on the shelves.
  std::uint64_t waiting_bytes() const { return all_ - room_; }

 private:
  std::vector<std::function<void()>> jobs_;
  std::mutex mutex_;
  std::atomic<std::uint64_t> room_;
  const std::uint64_t all_;
};

// An image and a material's use of it.
struct ImageUse {
  std::size_t image;
  bool basis, heights;
  shaders::ColorSpace space;
  auto operator<=>(const ImageUse&) const = default;
};

// Values that the builders will ask for, as far as the document alone shows it.
struct Wanted {
  std::set<ImageUse> images;
  std::set<std::size_t> views;
  std::vector<std::pair<const json*, Place>> draco;  // primitives

  explicit Wanted(const Document& document) : document_(document) {
    for (const json& material : list_of(document.json, "materials")) add_material(material);
    const json& meshes = list_of(document.json, "meshes");
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      const Place place = document.root.at("meshes").at(m).at("primitives");
      for (std::size_t p = 0; p < meshes[m]["primitives"].size(); ++p)
        add_primitive(meshes[m]["primitives"][p], place.at(p));
    }
    for (const json& skin : list_of(document.json, "skins"))
      if (skin.contains("inverseBindMatrices")) add_accessor(skin["inverseBindMatrices"]);
    for (const json& animation : list_of(document.json, "animations"))
      for (const json& sampler : animation["samplers"]) {
        add_accessor(sampler["input"]);
        add_accessor(sampler["output"]);
      }
  }

 private:
  void add_material(const json& material) {
    for (const MaterialTextureRow& row : material_textures())
      if (const json* owner = find_at(material, row.object); owner != nullptr && is_used(row, material))
        add_texture(*owner, row.name, row.space);
    if (const json* displacement = find_extension(material, "TESSERA_displacement"))
      add_texture(*displacement, "texture", shaders::ColorSpace::kLinear, true);
  }

  // The source that is taken first.
  void add_texture(const json& owner, std::string_view name, shaders::ColorSpace space, bool heights = false) {
    const json* info = find(owner, name);
    if (info == nullptr) return;
    const std::vector<TextureImage> sources =
        images_of(document_.json["textures"][(*info)["index"].get<std::size_t>()]);
    if (sources.empty()) return;
    const auto& [image, basis] = sources.front();
    images.insert({image, basis, heights, basis || heights ? shaders::ColorSpace::kLinear : space});
  }

  void add_primitive(const json& primitive, const Place& place) {
    if (!primitive["attributes"].contains("POSITION")) return;
    const json* compressed = find_extension(primitive, kDracoExtension);
    if (compressed != nullptr) draco.emplace_back(&primitive, place.at("extensions").at(kDracoExtension));
    for (const auto& [name, accessor] : primitive["attributes"].items())
      if (!name.starts_with("_") && (compressed == nullptr || !(*compressed)["attributes"].contains(name)))
        add_accessor(accessor);
    if (compressed == nullptr && primitive.contains("indices")) add_accessor(primitive["indices"]);
    for (const json& target : list_of(primitive, "targets"))
      for (const json& accessor : target) add_accessor(accessor);
  }

  void add_accessor(const json& index) {
    const json& accessor = document_.json["accessors"][index.get<std::size_t>()];
    add_view(accessor);
    if (const json* sparse = find(accessor, "sparse")) {
      add_view((*sparse)["indices"]);
      add_view((*sparse)["values"]);
    }
  }
  void add_view(const json& owner) {
    const json* view = find(owner, "bufferView");
    if (view == nullptr) return;
    const auto index = view->get<std::size_t>();
    if (find_meshopt(document_.json["bufferViews"][index]) != nullptr) views.insert(index);
  }

  const Document& document_;
};

// Adds the URIs of the wanted values.
void add_uris(const Document& document, const Wanted& wanted, ReadAhead& ahead, Jobs& jobs) {
  std::set<std::string_view> seen;
  const auto add = [&](const json& holder, const char* list, std::size_t index) {
    const json* uri = find(holder, "uri");
    if (uri == nullptr) return;
    const auto& text = uri->get_ref<const std::string&>();
    if (!seen.insert(text).second) return;
    const Place place = document.root.at(list).at(index).at("uri");
    jobs.add(ahead.uris, text, [&document, &text, place](MemoryBudget& budget) {
      return document.resources.read_uri(text, budget, place);
    });
  };
  const auto add_buffer_of = [&](const json& range) {
    const auto buffer = range["buffer"].get<std::size_t>();
    add(document.json["buffers"][buffer], "buffers", buffer);
  };
  for (const ImageUse& use : wanted.images) {
    const json& image = document.json["images"][use.image];
    if (const json* view = find(image, "bufferView"))
      add_buffer_of(document.json["bufferViews"][view->get<std::size_t>()]);
    else
      add(image, "images", use.image);
  }
  for (const auto& [primitive, place] : wanted.draco)
    add_buffer_of(
        document.json["bufferViews"][(*find_extension(*primitive, kDracoExtension))["bufferView"].get<std::size_t>()]);
  for (const std::size_t view : wanted.views) add_buffer_of(*find_meshopt(document.json["bufferViews"][view]));
}

void add_image(const Document& document, const ImageUse& use, Bytes bytes, ReadAhead& ahead, Jobs& jobs) {
  const Place place = document.root.at("images").at(use.image);
  const auto account = [&document, place](MemoryBudget& budget) {
    return ImageAccount{document.limits.image, budget, place};
  };
  if (use.basis)
    jobs.add(use.heights ? ahead.basis_heights : ahead.basis_colors, use.image,
             [=](MemoryBudget& budget) { return unpack_basis_image(bytes, account(budget)); });
  else if (use.heights)
    jobs.add(ahead.heights, use.image, [=](MemoryBudget& budget) { return read_height_image(bytes, account(budget)); });
  else
    jobs.add(ahead.colors, std::pair(use.image, use.space),
             [=](MemoryBudget& budget) { return read_color_image(bytes, use.space, account(budget)); });
}

// Streams and images whose bytes are there.
void add_streams(const Document& document, const Wanted& wanted, ReadAhead& ahead, Jobs& jobs) {
  for (const auto& [primitive, place] : wanted.draco) {
    const auto view = (*find_extension(*primitive, kDracoExtension))["bufferView"].get<std::size_t>();
    if (const std::optional<Bytes> bytes = document.resources.known_view(view))
      jobs.add(ahead.draco, primitive,
               [bytes = *bytes, request = draco_request(document, *primitive), place = place](MemoryBudget& budget) {
                 return decode_draco(bytes, request, budget, place);
               });
  }
  for (const ImageUse& use : wanted.images)
    if (const std::optional<Bytes> bytes = document.resources.known_image(use.image))
      add_image(document, use, *bytes, ahead, jobs);
  for (const std::size_t index : wanted.views) {
    const char* name = nullptr;
    const json& meshopt = *find_meshopt(document.json["bufferViews"][index], &name);
    const Place place = document.root.at("bufferViews").at(index).at("extensions").at(name);
    if (const std::optional<Bytes> bytes = document.resources.known_range(meshopt))
      jobs.add(ahead.views, index, [bytes = *bytes, &meshopt, place](MemoryBudget& budget) {
        return read_meshopt(meshopt, bytes, budget, place);
      });
  }
}

}  // namespace

void ReadAhead::clear() {
  uris.clear();
  views.clear();
  draco.clear();
  colors.clear();
  heights.clear();
  basis_colors.clear();
  basis_heights.clear();
}

void read_ahead(Document& document) {
  if (thread_count() < 2) return;
  const Wanted wanted(document);
  const auto ahead = std::make_shared<ReadAhead>();
  Jobs jobs(document.budget.left_bytes());
  add_uris(document, wanted, *ahead, jobs);
  jobs.run();
  document.resources.use(*ahead);
  document.ahead = ahead;
  add_streams(document, wanted, *ahead, jobs);
  if (jobs.count() > 1) jobs.run();
  document.budget.keep_waiting(jobs.waiting_bytes(), [ahead] { ahead->clear(); });
}

}  // namespace tessera::scene::gltf
