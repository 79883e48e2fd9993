#include "tests/replay/glb_rules.h"

#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

namespace tessera::test {
namespace {

using nlohmann::json;
constexpr const char *kDraco = "KHR_draco_mesh_compression", *kClusters = "TESSERA_clusters";
constexpr const char* kMeshopt[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

const json& list_of(const json& object, const char* name) {
  static const json kEmpty = json::array();
  const auto found = object.find(name);
  return found == object.end() ? kEmpty : *found;
}

std::size_t element_bytes(const json& accessor) {
  const int component = accessor["componentType"];
  const std::size_t size = component <= 5121 ? 1 : component <= 5123 ? 2 : 4;
  const std::string type = accessor["type"];
  return size * (type == "SCALAR" ? 1 : type == "MAT4" ? 16 : static_cast<std::size_t>(type.back() - '0'));
}

class Rules {
 public:
  explicit Rules(const GlbParts& parts) : d_(parts.document), binary_(parts.binary) {}

  std::vector<std::string> faults() {
    buffers();
    uses();
    for (std::size_t a = 0; a < list_of(d_, "accessors").size(); ++a) range(a);
    for (std::size_t v = 0; v < list_of(d_, "bufferViews").size(); ++v) view(v);
    for (std::size_t i = 0; i < list_of(d_, "images").size(); ++i) image(i);
    extension_lists();
    return std::move(faults_);
  }

 private:
  template <class... Args>
  void fault(fmt::format_string<Args...> format, Args&&... args) {
    faults_.push_back(fmt::format(format, std::forward<Args>(args)...));
  }

  void buffers() {
    const json& list = list_of(d_, "buffers");
    if (list.empty()) {
      if (!binary_.empty()) fault("a binary chunk without a buffer");
      return;
    }
    if (list.size() > 2 || list[0].contains("uri")) return fault("buffers: not exactly the binary chunk");
    if (list.size() == 2) fallback(list[1]);
    const std::size_t length = list[0]["byteLength"];
    if (binary_.size() < length || binary_.size() > length + 3)
      fault("the chunk has {} bytes, its buffer says {}", binary_.size(), length);
  }

  // Ranges hold stored values: the ranges of integers are integers, also where they are normalised.
  void range(std::size_t number) {
    const json& accessor = list_of(d_, "accessors")[number];
    if (accessor["componentType"] == 5126) return;
    for (const char* end : {"min", "max"})
      for (const json& value : list_of(accessor, end))
        if (value.get<double>() != std::floor(value.get<double>())) fault("accessor {}: {} is no integer", number, end);
  }

  // A second buffer has no data; compressed views unpack into it, one after the other.
  void fallback(const json& buffer) {
    if (buffer.contains("uri")) fault("the fallback has a uri");
    std::size_t end = 0;
    for (const json& view : list_of(d_, "bufferViews")) {
      if (compression(view) == nullptr) continue;
      if (view["buffer"] != 1) fault("a compressed view is not of the fallback");
      if (view["byteOffset"] != end) fault("a compressed view does not follow its predecessor in the fallback");
      end = (view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>() + 3) / 4 * 4;
    }
    if (buffer["byteLength"] != end)
      fault("the fallback has {} bytes, {} are needed", buffer["byteLength"].dump(), end);
    const json& tags = list_of(buffer, "extensions");
    for (const char* name : kMeshopt)
      if (tags.contains(name) && tags[name].value("fallback", false)) return;
    fault("the fallback does not say so");
  }

  // The extension of a compressed view, or null.
  static const json* compression(const json& view) {
    const json& extensions = list_of(view, "extensions");
    for (const char* name : kMeshopt)
      if (extensions.contains(name)) return &extensions[name];
    return nullptr;
  }

  void use(const json& index, const std::string& what) {
    const std::size_t accessor = index;
    const json& a = d_["accessors"][accessor];
    used_.insert(accessor);
    if (!a.contains("bufferView")) return;
    const std::size_t view = a["bufferView"];
    users_[view].insert(what);
    accessors_of_[view].insert(accessor);
    const json& v = d_["bufferViews"][view];
    const std::size_t stride = v.value("byteStride", element_bytes(a)), count = a["count"],
                      offset = a.value("byteOffset", std::size_t{0});
    if (offset + (count - 1) * stride + element_bytes(a) > v["byteLength"].get<std::size_t>())
      fault("accessor {} reads beyond its view", accessor);
    if (what == "vertices" && stride % 4 != 0)
      fault("accessor {}: vertex attributes must start at multiples of 4", accessor);
  }

  void primitive(const json& p, const std::string& where) {
    const json& extensions = p.contains("extensions") ? p["extensions"] : list_of(p, "extensions");
    const json* draco = extensions.contains(kDraco) ? &extensions[kDraco] : nullptr;
    const json* clusters =
        extensions.contains(kClusters) && extensions[kClusters].contains("encoding") ? &extensions[kClusters] : nullptr;
    if (clusters != nullptr) users_[(*clusters)["bufferView"]].insert("clusters");
    std::set<std::size_t> counts;
    for (const auto& [name, index] : p["attributes"].items()) {
      use(index, "vertices");
      const json& accessor = d_["accessors"][index.get<std::size_t>()];
      counts.insert(accessor["count"].get<std::size_t>());
      if (name == "POSITION" && (!accessor.contains("min") || !accessor.contains("max")))
        fault("{}: POSITION has no min and max", where);
      const bool in_clusters = clusters != nullptr && name == "POSITION";
      if (in_clusters && accessor.contains("bufferView")) fault("{}: POSITION has data twice", where);
      if (!accessor.contains("bufferView") && !in_clusters &&
          (draco == nullptr || !(*draco)["attributes"].contains(name)))
        fault("{}: {} has no data", where, name);
    }
    if (counts.size() != 1) fault("{}: attributes of different counts", where);
    for (const json& target : list_of(p, "targets"))
      for (const auto& [name, index] : target.items()) {
        use(index, "vertices");
        if (d_["accessors"][index.get<std::size_t>()]["count"] != *counts.begin())
          fault("{}: a target of another count", where);
        if (name == "POSITION" && !d_["accessors"][index.get<std::size_t>()].contains("min"))
          fault("{}: a target's POSITION has no min", where);
      }
    if (p.contains("indices")) use(p["indices"], "indices");
    if (draco == nullptr) return;
    if (!p.contains("indices")) fault("{}: Draco without indices", where);
    if (p.value("mode", 4) != 4 && p.value("mode", 4) != 5) fault("{}: Draco in mode {}", where, p["mode"].dump());
    users_[(*draco)["bufferView"]].insert("draco");
    for (const auto& [name, id] : (*draco)["attributes"].items())
      if (!p["attributes"].contains(name)) fault("{}: Draco names {}, the primitive does not", where, name);
  }

  void uses() {
    const json& meshes = list_of(d_, "meshes");
    for (std::size_t m = 0; m < meshes.size(); ++m)
      for (std::size_t p = 0; p < meshes[m]["primitives"].size(); ++p)
        primitive(meshes[m]["primitives"][p], fmt::format("mesh {} primitive {}", m, p));
    for (const json& skin : list_of(d_, "skins"))
      if (skin.contains("inverseBindMatrices")) use(skin["inverseBindMatrices"], "matrices");
    for (const json& animation : list_of(d_, "animations"))
      for (const json& sampler : animation["samplers"]) {
        use(sampler["input"], "keys");
        use(sampler["output"], "keys");
        if (!d_["accessors"][sampler["input"].get<std::size_t>()].contains("min"))
          fault("animation times without min and max");
      }
    const json& accessors = list_of(d_, "accessors");
    for (std::size_t a = 0; a < accessors.size(); ++a) {
      if (!used_.contains(a)) fault("accessor {} is never read", a);
      if (accessors[a].contains("sparse"))
        for (const char* part : {"indices", "values"})
          users_[accessors[a]["sparse"][part]["bufferView"]].insert("sparse");
    }
    for (const json& i : list_of(d_, "images"))
      if (i.contains("bufferView")) users_[i["bufferView"]].insert("image");
    const json::json_pointer environment("/extensions/TESSERA_capture/environment/bufferView");
    if (d_.contains(environment)) users_[d_[environment]].insert("environment");
  }

  void view(std::size_t v) {
    const json& view = d_["bufferViews"][v];
    const json* compressed = compression(view);
    const json& range = compressed == nullptr ? view : *compressed;
    if (range["buffer"] != 0) fault("view {} does not read the binary chunk", v);
    if (compressed != nullptr &&
        (*compressed)["count"].get<std::size_t>() * (*compressed)["byteStride"].get<std::size_t>() !=
            view["byteLength"])
      fault("view {} has another length than its elements", v);
    const std::size_t offset = range.value("byteOffset", std::size_t{0}), length = range["byteLength"];
    if (offset % 4 != 0) fault("view {} starts at {}", v, offset);
    if (offset + length > d_["buffers"][0]["byteLength"].get<std::size_t>())
      fault("view {} ends outside the buffer", v);
    if (offset < end_ || offset > end_ + 3) fault("view {} does not follow its predecessor", v);
    end_ = offset + length;
    const std::set<std::string>& users = users_[v];
    if (users.size() != 1) return fault("view {} has {} kinds of users", v, users.size());
    const bool vertices = users.contains("vertices"), indices = users.contains("indices");
    if (view.contains("byteStride") && !vertices) fault("view {} of {} has a byteStride", v, *users.begin());
    if (vertices && accessors_of_[v].size() > 1 && !view.contains("byteStride"))
      fault("view {} is shared without a byteStride", v);
    if (view.value("target", 0) != (vertices ? 34962 : indices ? 34963 : 0))
      fault("view {} of {} has target {}", v, *users.begin(), view.value("target", 0));
  }

  void image(std::size_t i) {
    const json& image = d_["images"][i];
    if (image.contains("uri") || !image.contains("bufferView")) return fault("image {} is not inside", i);
    const std::string bytes = binary_.substr(
        d_["bufferViews"][image["bufferView"].get<std::size_t>()].value("byteOffset", std::size_t{0}), 3);
    if (image.value("mimeType", "") != (bytes == "\xFF\xD8\xFF" ? "image/jpeg"
                                        : bytes == "RIF"        ? "image/webp"
                                        : bytes == "\xAB"
                                                   "KT"
                                            ? "image/ktx2"
                                            : "image/png"))
      fault("image {} has the wrong mimeType", i);
  }

  void find_extensions(const json& value, std::set<std::string>& found) {
    if (value.is_object() && value.contains("extensions"))
      for (const auto& [name, object] : value["extensions"].items()) found.insert(name);
    if (value.is_structured())
      for (const json& inner : value) find_extensions(inner, found);
  }

  void extension_lists() {
    std::set<std::string> found, used, required;
    find_extensions(d_, found);
    for (const json& name : list_of(d_, "extensionsUsed")) used.insert(name);
    for (const json& name : list_of(d_, "extensionsRequired")) required.insert(name);
    for (const std::string& name : found)
      if (!used.contains(name)) fault("{} is not in extensionsUsed", name);
    for (const std::string& name : required)
      if (!used.contains(name)) fault("{} is required but not used", name);
    for (const char* name : kMeshopt)
      if (required.contains(name) != found.contains(name))
        fault("{}: required without use, or used without being required", name);
    if (required.contains(kDraco) && !found.contains(kDraco)) fault("Draco is required, no primitive has it");
    for (const char* list : {"extensionsUsed", "extensionsRequired"})
      if (d_.contains(list) && d_[list].empty()) fault("{} is empty", list);
  }

  const json& d_;
  const std::string& binary_;
  std::vector<std::string> faults_;
  std::set<std::size_t> used_;
  std::map<std::size_t, std::set<std::string>> users_;
  std::map<std::size_t, std::set<std::size_t>> accessors_of_;
  std::size_t end_ = 0;
};

}  // namespace

std::vector<std::string> glb_faults(const GlbParts& parts) { return Rules(parts).faults(); }

std::vector<std::string> glb_faults(const std::string& bytes) {
  std::vector<std::string> faults;
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return std::size_t{value};
  };
  if (bytes.size() < 20 || !bytes.starts_with("glTF") || word(4) != 2) return {"is not a glTF 2 container"};
  if (word(8) != bytes.size()) faults.push_back("the header's length is not the file's");
  if (bytes.size() % 4 != 0 || word(12) % 4 != 0) faults.push_back("a chunk is not a multiple of four bytes");
  const std::vector<std::string> inside = glb_faults(glb_parts(bytes));
  faults.insert(faults.end(), inside.begin(), inside.end());
  return faults;
}

}  // namespace tessera::test
