#include "tests/scene/gltf/broken_captures.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

namespace fs = std::filesystem;

std::string header(std::uint32_t version, std::uint32_t length) {
  return "glTF" + little_endian32(version) + little_endian32(length);
}

std::string with_length(std::string glb) {
  return glb.replace(8, 4, little_endian32(static_cast<std::uint32_t>(glb.size())));
}

const std::string kAsset = R"({"asset":{"version":"2.0"}})";

// ---- GLB --------------------------------------------------------------------------------------------------------

BrokenClass truncated_glb() {
  const std::string good = everything_asset().glb();
  const auto json_bytes =
      static_cast<std::size_t>(static_cast<unsigned char>(good[12])) + 256 * static_cast<unsigned char>(good[13]);
  const std::size_t json_end = 20 + json_bytes;
  BrokenClass out{"GlbThatIsCutOff", {}};
  const auto cut = [&](const char* name, std::size_t size, const char* place) {
    out.captures.push_back(file_of(std::string(name) + ".glb", good.substr(0, size), place));
    // The same with a header that agrees with the shorter file.
    if (size >= 12)
      out.captures.push_back(file_of(std::string(name) + "_length_mended.glb", with_length(good.substr(0, size)), ""));
  };
  cut("nothing", 0, "byte 0");
  cut("one_byte", 1, "byte");
  cut("magic_only", 4, "byte 4");
  cut("header_cut", 11, "byte 11");
  cut("header_only", 12, "byte 8");
  cut("chunk_header_cut", 19, "byte 8");
  cut("chunk_header_only", 20, "byte 8");
  cut("json_cut", 20 + json_bytes / 2, "byte 8");
  cut("json_last_byte_missing", json_end - 1, "byte 8");
  cut("binary_chunk_header_cut", json_end + 5, "byte 8");
  cut("binary_cut", json_end + 8 + 16, "byte 8");
  cut("binary_last_byte_missing", good.size() - 1, "byte 8");
  return out;
}

BrokenClass wrong_glb() {
  const std::string json_chunk = glb_chunk("JSON", kAsset), binary_chunk = glb_chunk("BIN\0", "abcd");
  const auto glb = [](const std::string& chunks) { return with_length(header(2, 0) + chunks); };
  const std::string odd = kAsset + std::string((4 - kAsset.size() % 4) % 4 + 1, ' ');
  return {"GlbWithAWrongHeader",
          {
              file_of("magic.glb", "glTG" + glb(json_chunk).substr(4), "byte 0"),
              file_of("version_1.glb", with_length(header(1, 0) + json_chunk), "byte 4", "version 1"),
              file_of("version_3.glb", with_length(header(3, 0) + json_chunk), "byte 4", "version 3"),
              file_of("length_too_large.glb", header(2, 1000) + json_chunk, "byte 8", "1000"),
              file_of("length_2_to_32.glb", header(2, 0xFFFFFFFF) + json_chunk, "byte 8"),
              file_of("length_zero.glb", header(2, 0) + json_chunk, "byte 8"),
              file_of("length_cuts_chunk.glb", header(2, 24) + json_chunk, "byte 12"),
              strictly(file_of("json_length_not_multiple_of_4.glb",
                               glb(little_endian32(static_cast<std::uint32_t>(odd.size())) + "JSON" + odd), "byte 12",
                               "multiple of 4")),
              file_of("chunk_length_2_to_32.glb", glb(little_endian32(0xFFFFFFFC) + json_chunk.substr(4)), "byte 12"),
              file_of("no_json.glb", glb(binary_chunk), "byte 16", "not JSON"),
              file_of("two_json.glb", glb(json_chunk + json_chunk), "byte", "second"),
              file_of("two_binary.glb", glb(json_chunk + binary_chunk + binary_chunk), "byte", "second"),
              file_of("empty_json_chunk.glb", glb(glb_chunk("JSON", "")), "byte 20"),
              file_of("json_fault_counts_from_file.glb", glb(glb_chunk("JSON", "{,")), "byte 21"),
          }};
}

// ---- JSON -------------------------------------------------------------------------------------------------------

BrokenClass broken_json() {
  std::string objects;
  for (int i = 0; i < 100; ++i) objects += R"({"asset":)";
  std::string latin1 = kAsset;
  latin1.insert(latin1.size() - 1, ",\"extras\":\"\xE9\"");
  return {"TextThatIsNotJson",
          {
              file_of("empty.gltf", "", "byte 0", "empty"),
              file_of("words.gltf", "not a capture", "byte 1"),
              file_of("cut.gltf", kAsset.substr(0, 20), "byte"),
              file_of("trailing_comma.gltf", R"({"asset":{"version":"2.0"},})", "byte 27"),
              file_of("text_after.gltf", kAsset + "}", "byte 27"),
              file_of("invalid_utf8.gltf", latin1, "byte"),
              file_of("overlong_utf8.gltf",
                      R"({"asset":{"version":"2.0"},"extras":")"
                      "\xC0\x80\"}",
                      "byte"),
              file_of("control_character.gltf", "{\"asset\":{\"version\":\"2.0\n\"}}", "byte"),
              file_of("number_beyond_double.gltf", R"({"asset":{"version":"2.0"},"extras":1e999})", "byte"),
              file_of("not_a_number.gltf", R"({"asset":{"version":"2.0"},"extras":NaN})", "byte"),
              file_of("deep_arrays.gltf", std::string(1000000, '['), "/0/0/0...", "deeper"),
              file_of("deep_objects.gltf", objects, "/asset/asset/asset...", "deeper"),
              file_of("key_twice.gltf", R"({"asset":{"version":"2.0"},"nodes":[{"scale":[1,1,1],"scale":[2,2,2]}]})",
                      "/nodes/0", "twice"),
              file_of("array.gltf", "[]", "the document", "not an object"),
              file_of("null.gltf", "null", "the document", "not an object"),
              file_of("utf16.gltf", std::string("\xFF\xFE{\0}\0", 6), "byte"),
          }};
}

// ---- Files and URIs ---------------------------------------------------------------------------------------------

// An asset whose buffer is the given URI; the URI's target may exist.
BrokenCapture buffer_uri(std::string name, std::string uri, std::string fault) {
  return {std::move(name),
          [uri](const fs::path& folder) {
            const GltfAsset asset = everything_asset();
            const std::string bytes(asset.binary.begin(), asset.binary.end());
            fs::create_directory(folder / "inside");
            fs::create_directory(folder / "inside" / "folder");
            write_text(folder / "outside.bin", bytes);
            write_text(folder / "inside" / "short.bin", bytes.substr(0, 100));
            fs::create_symlink(folder / "outside.bin", folder / "inside" / "link.bin");
            fs::create_directory_symlink(folder, folder / "inside" / "up");
            std::string filled = uri;
            if (const auto at = filled.find("FOLDER"); at != std::string::npos) filled.replace(at, 6, folder.string());
            return put(folder / "inside", "capture.gltf", asset.gltf_with_file(filled));
          },
          "/buffers/0", std::move(fault)};
}

BrokenClass uris_that_leave() {
  return {"UriThatLeavesTheFolder",
          {
              buffer_uri("parent", "../outside.bin", "leaves"),
              buffer_uri("parent_after_folder", "folder/../../outside.bin", "leaves"),
              buffer_uri("parent_escaped", "%2e%2e/outside.bin", "leaves"),
              buffer_uri("parent_all_escaped", "%2E%2E%2Foutside.bin", "leaves"),
              buffer_uri("absolute", "FOLDER/outside.bin", "relative"),
              buffer_uri("absolute_escaped", "%2FFOLDER/outside.bin", "relative"),
              buffer_uri("backslash", "..\\outside.bin", "backslash"),
              buffer_uri("backslash_escaped", "..%5Coutside.bin", "backslash"),
              buffer_uri("file_scheme", "file://FOLDER/outside.bin", "scheme"),
              buffer_uri("http_scheme", "http://127.0.0.1/outside.bin", "scheme"),
              buffer_uri("network_path", "//127.0.0.1/outside.bin", "relative"),
              buffer_uri("drive", "c:/outside.bin", "drive"),
              buffer_uri("link_to_file", "link.bin", "link"),
              buffer_uri("link_to_folder", "up/outside.bin", "link"),
          }};
}

BrokenClass files_that_fail() {
  const auto data = [](const char* name, const char* uri, const char* fault) { return buffer_uri(name, uri, fault); };
  return {"ResourceThatCannotBeRead",
          {
              buffer_uri("missing", "missing.bin", "no such file"),
              buffer_uri("folder", "folder", "folder"),
              buffer_uri("the_folder_itself", ".", "folder"),
              buffer_uri("short", "short.bin", "100"),
              buffer_uri("empty_uri", "", "empty"),
              buffer_uri("zero_byte", "short.bin%00", "zero byte"),
              buffer_uri("escape_cut", "short.bin%2", "escape"),
              buffer_uri("escape_of_letters", "short%zz.bin", "escape"),
              data("base64_character", "data:application/octet-stream;base64,AA*A", "base64"),
              data("base64_length", "data:application/octet-stream;base64,AAAAA", "base64"),
              data("base64_padding_inside", "data:application/octet-stream;base64,AA==AAAA", "base64"),
              data("data_without_comma", "data:application/octet-stream;base64", "without data"),
              data("data_too_short", "data:application/octet-stream;base64,AAAA", "says"),
              {"capture_missing", [](const fs::path& folder) { return folder / "none.glb"; }, "", "no such file"},
              {"capture_is_a_folder", [](const fs::path& folder) { return folder; }, "", "folder"},
              damaged(
                  "no_binary_chunk", [](GltfAsset& a) { a.binary.clear(); }, "/buffers/0", "no binary chunk"),
              damaged(
                  "binary_chunk_short", [](GltfAsset& a) { a.binary.resize(40); }, "/buffers/0", "40"),
              damaged(
                  "second_buffer_without_uri", [](GltfAsset& a) { a.document["bufferViews"][0]["buffer"] = 1; },
                  "/bufferViews/0/buffer"),
          }};
}

}  // namespace

std::vector<BrokenClass> broken_containers() {
  return {truncated_glb(), wrong_glb(), broken_json(), uris_that_leave(), files_that_fail()};
}

}  // namespace tessera::test
