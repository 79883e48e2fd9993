#include "tests/scene/gltf/broken_captures.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

json& accessor(GltfAsset& asset, int index) { return asset.document["accessors"][static_cast<std::size_t>(index)]; }

// A row of broken_documents.json: [name, pointer, value, more]. `more` may have `without`, for a value that is taken away,
// `place` (else the pointer) and `fault` of the message, and `strict`. What the law has in `before` is set first.
BrokenCapture edit_of(const json& row, const json& before) {
  const json more = row.size() > 3 ? row[3] : json::object();
  const json::json_pointer at(row[1].get<std::string>());
  const bool without = more.contains("without");
  BrokenCapture broken = damaged(
      row[0],
      [=, value = row[2]](GltfAsset& a) {
        for (const auto& [pointer, sound] : before.items()) a.document[json::json_pointer(pointer)] = sound;
        if (without)
          a.document[at.parent_pointer()].erase(at.back());
        else
          a.document[at] = value;
      },
      more.value("place", at.to_string()), more.value("fault", ""));
  broken.strict = more.value("strict", false);
  return broken;
}

// Two indices of the sparse control points.
BrokenCapture sparse_indices(const char* name, std::uint16_t first, std::uint16_t second) {
  return damaged(
      name,
      [=](GltfAsset& a) {
        const int view = accessor(a, kControlPoints)["sparse"]["indices"]["bufferView"];
        std::memcpy(&a.binary[a.first_byte_of_view(view)], &first, 2);
        std::memcpy(&a.binary[a.first_byte_of_view(view) + 2], &second, 2);
      },
      "/accessors/" + std::to_string(kControlPoints) + "/sparse/indices");
}

BrokenCapture cycle_of(const char* name, int nodes) {
  return damaged(
      name,
      [=](GltfAsset& a) {
        for (int i = 0; i < nodes; ++i) a.add("nodes", {{"children", {8 + (i + 1) % nodes}}});
      },
      "/nodes/", "ancestor");
}

BrokenCapture of_length_zero(const char* name, const char* list, json row, const char* place) {
  return strictly(damaged(
      name, [=](GltfAsset& a) { a.add(list, row); }, place, "is 0, outside [1, 9007199254740992]"));
}

// Strides that have to be made.
std::vector<BrokenCapture> strides() {
  const char* const indices = "/meshes/0/primitives/0/indices";
  return {
      strictly(damaged(
          "stride_not_multiple_of_4",
          [](GltfAsset& a) {
            const std::vector<std::uint16_t> pairs(16, 7);
            const int view = a.add_view({reinterpret_cast<const std::uint8_t*>(pairs.data()), 32}, {{"byteStride", 6}});
            a.add("accessors", {{"bufferView", view}, {"componentType", 5123}, {"type", "VEC2"}, {"count", 4}});
          },
          "/byteStride", "is not a multiple of 4")),
      damaged(
          "stride_on_indices",
          [](GltfAsset& a) {
            a.document["bufferViews"][3].update({{"byteStride", 4}, {"byteLength", 24}});
          },
          indices, "byteStride"),
      strictly(damaged(
          "stride_of_indices_as_they_are",
          [](GltfAsset& a) {
            const std::vector<std::uint32_t> list = {0, 1, 2, 2, 1, 3};
            a.document["meshes"][0]["primitives"][0]["indices"] = a.add_accessor("SCALAR", list);
            a.document["bufferViews"].back()["byteStride"] = 4;
          },
          indices, "byteStride"))};
}

// What takes more than one edit, by law.
std::map<std::string, std::vector<BrokenCapture>> several_edits() {
  std::map<std::string, std::vector<BrokenCapture>> all;
  all["ViewOrAccessorOutOfRange"] = strides();
  all["ViewOrAccessorOutOfRange"].insert(
      all["ViewOrAccessorOutOfRange"].end(),
      {of_length_zero("view_length_zero", "bufferViews", {{"buffer", 0}, {"byteLength", 0}}, "/byteLength"),
       of_length_zero("buffer_length_zero", "buffers", {{"byteLength", 0}}, "/buffers/1/byteLength"),
       damaged(
           "misaligned_in_view",
           [](GltfAsset& a) {
             accessor(a, kMorphWeights).update({{"byteOffset", 2}, {"count", 2}});
           },
           "/accessors/" + std::to_string(kMorphWeights), "multiple")});
  all["SparseAccessorBroken"] = {sparse_indices("index_out_of_range", 5, 16),
                                 sparse_indices("index_minus_1", 5, 0xFFFF), sparse_indices("indices_equal", 5, 5),
                                 sparse_indices("indices_decrease", 6, 5)};
  all["MeshThatDoesNotFitTogether"] = {damaged(
                                           "skin_without_joints",
                                           [](GltfAsset& a) {
                                             for (const char* name : {"JOINTS_0", "WEIGHTS_0"})
                                               a.document["meshes"][0]["primitives"][0]["attributes"].erase(name);
                                           },
                                           "/nodes/1/skin", "JOINTS_0"),
                                       strictly(damaged(
                                           "target_counts_differ_between_primitives",
                                           [](GltfAsset& a) {
                                             json copy = a.document["meshes"][0]["primitives"][0];
                                             copy.erase("targets");
                                             a.document["meshes"][0]["primitives"].push_back(copy);
                                           },
                                           "/meshes/0/primitives/1/targets"))};
  all["NodeGraphThatIsNoForest"] = {cycle_of("cycle_of_many", 1000), cycle_of("long_chain_into_a_cycle", 100000)};
  return all;
}

}  // namespace

std::vector<BrokenClass> broken_documents() {
  std::vector<BrokenClass> classes;
  std::map<std::string, std::vector<BrokenCapture>> more = several_edits();
  const fs::path table = fs::path(TESSERA_SOURCE_DIR) / "tests/scene/gltf/broken_documents.json";
  for (const json& law : json::parse(read_text(table))) {
    BrokenClass& made = classes.emplace_back(BrokenClass{law["law"], std::move(more[law["law"]])});
    for (const json& row : law["edits"]) made.captures.push_back(edit_of(row, law.value("before", json::object())));
  }
  return classes;
}

}  // namespace tessera::test
