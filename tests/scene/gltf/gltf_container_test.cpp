#include "base/error.h"
#include "scene/capture_reader.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/resources.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::gltf::gltf_container_test {
namespace {

using test::GltfAsset;

std::vector<std::uint8_t> as_bytes(const std::string& text) { return {text.begin(), text.end()}; }
std::string as_text(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

// ---- Container --------------------------------------------------------------------------------------------------

TEST(GltfContainer, SplitsAGlbIntoItsChunks) {
  const std::string json = R"({"asset":{"version":"2.0"}})";
  const Container container = open_container(as_bytes(test::make_glb(json, test::bytes_of("12345"))), "f");
  EXPECT_EQ(container.json.substr(0, json.size()), json);
  EXPECT_EQ(container.json.find_first_not_of(' ', json.size()), std::string::npos);
  EXPECT_EQ(container.json_offset, 20u);
  EXPECT_TRUE(container.has_binary);
  EXPECT_EQ(as_text(container.binary), std::string("12345\0\0\0", 8));
}

TEST(GltfContainer, RefusesEveryTruncatedLength) {
  const std::string good = test::make_glb(R"({"asset":{"version":"2.0"}})", test::bytes_of("12345678"));
  for (std::size_t length = 0; length < good.size(); ++length) {
    std::vector<std::uint8_t> bytes = as_bytes(good.substr(0, length));
    bytes.shrink_to_fit();
    // Below four bytes there is no magic number: taken for text, which then is no JSON.
    if (length > 0 && length < 4)
      EXPECT_NO_THROW(open_container(bytes, "f")) << length;
    else
      EXPECT_THROW(open_container(bytes, "f"), InputError) << length;
  }
}

TEST(GltfContainer, LoadsOrRefusesWhicheverByteOfTheHeadersIsWrong) {
  const std::string good = test::make_glb(R"({"asset":{"version":"2.0"}})", test::bytes_of("12345678"));
  for (std::size_t at = 0; at < good.size(); ++at)
    for (const int flip : {1, 4, 128, 255}) {
      std::string bad = good;
      bad[at] = static_cast<char>(bad[at] ^ flip);
      try {
        open_container(as_bytes(bad), "f");
      } catch (const InputError&) {
      }
    }
}

// ---- URIs -------------------------------------------------------------------------------------------------------

TEST(ResolveUri, NeverNamesAFileOutsideTheFolder) {
  const test::TemporaryFolder top;
  fs::create_directories(top / "in" / "sub");
  fs::create_directory_symlink(top.path(), top / "in" / "up");
  const fs::path inside = fs::canonical(top / "in");
  const Place place = Place("f").at("buffers").at(std::size_t{0}).at("uri");
  const std::string parts[] = {"..", ".", "sub", "up", "%2e%2e", "%2E.", "a", "", "..%2f..", "x%5c..", "~"};
  for (const std::string& a : parts)
    for (const std::string& b : parts)
      for (const std::string& c : parts)
        for (const std::string& uri : {a + "/" + b + "/" + c, a + "/" + b, a}) {
          try {
            const fs::path found = resolve_uri(uri, top / "in", place);
            const auto [left, right] = std::mismatch(inside.begin(), inside.end(), found.begin(), found.end());
            EXPECT_TRUE(left == inside.end()) << uri << " names " << found;
          } catch (const InputError& error) {
            EXPECT_EQ(error.place(), "/buffers/0/uri");
          }
        }
}

TEST(ResolveUri, UndoesPercentEscapes) {
  const test::TemporaryFolder folder;
  const Place place("f");
  EXPECT_EQ(resolve_uri("a%20b%2Ebin", folder.path(), place), fs::canonical(folder.path()) / "a b.bin");
  EXPECT_EQ(resolve_uri("100%25.bin", folder.path(), place), fs::canonical(folder.path()) / "100%.bin");
  EXPECT_EQ(resolve_uri("%C3%A4.bin", folder.path(), place), fs::canonical(folder.path()) / "\xC3\xA4.bin");
}

TEST(ResolveUri, RefusesSchemesAndBrokenEscapes) {
  const test::TemporaryFolder folder;
  for (const char* uri :
       {"http://h/f", "file:///f", "c:f", "a+b:f", "/f", "//h/f", "\\f", "a\\f", "%", "%4", "%4g", "a%00b", ""})
    EXPECT_THROW(resolve_uri(uri, folder.path(), Place("f")), InputError) << uri;
}

TEST(DataUri, GivesBackEveryByteStringThroughBase64) {
  test::Random random(3);
  for (int length = 0; length < 100; ++length) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(length));
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random.integer(0, 255));
    const std::string text = test::base64(bytes);
    EXPECT_EQ(decode_data_uri("data:application/octet-stream;base64," + text, Place("f")), bytes);
    // Without padding and with the alphabet of RFC 4648 section 5 it means the same.
    std::string url = text.substr(0, text.find('='));
    for (char& c : url) c = c == '+' ? '-' : c == '/' ? '_' : c;
    EXPECT_EQ(decode_data_uri("data:;base64," + url, Place("f")), bytes);
  }
}

TEST(DataUri, ReadsPercentEscapedText) {
  EXPECT_EQ(as_text(decode_data_uri("data:text/plain,a%20b%2C", Place("f"))), "a b,");
}

TEST(DataUri, RefusesOtherUris) {
  for (const char* uri : {"data:", "data:;base64", "data:;base64,A", "data:;base64,AAAAA", "data:;base64,A*AA",
                          "data:;base64,AA=A", "data:,%4"})
    EXPECT_THROW(decode_data_uri(uri, Place("f")), InputError) << uri;
}

// ---- Draco streams ----------------------------------------------------------------------------------------------

// A damaged stream that still decodes gives a result that a sound one could: indices of existing points and finite
// numbers.
void expect_sound_or_refused(const GltfAsset& asset, const fs::path& file, const std::string& what) {
  test::write_text(file, asset.glb());
  try {
    CaptureLimits limits;
    limits.max_bytes = 64 << 20;
    const Capture capture = read_capture(file, limits);
    const Primitive& primitive = capture.meshes.at(0).primitives.at(0);
    for (const std::uint32_t index : primitive.indices) EXPECT_LT(index, primitive.vertices.count()) << what;
    for (const Vec3& p : primitive.vertices.positions)
      EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) << what;
  } catch (const InputError&) {
  } catch (const LimitError&) {
  }
}

TEST(DracoStream, IsSoundOrRefusedAtEveryTruncatedLength) {
  const test::TemporaryFolder folder;
  for (const bool sequential : {true, false}) {
    const GltfAsset good = test::draco_asset(sequential);
    for (std::size_t length = 1; length < good.binary.size(); ++length) {
      GltfAsset bad = good;
      bad.binary.resize(length);
      bad.document["buffers"][0]["byteLength"] = length;
      bad.document["bufferViews"][0]["byteLength"] = length;
      expect_sound_or_refused(bad, folder / "f.glb", "length " + std::to_string(length));
    }
  }
}

void expect_sound_or_refused_whichever_byte_is_wrong(const std::vector<int>& flips) {
  const test::TemporaryFolder folder;
  for (const bool sequential : {true, false}) {
    const GltfAsset good = test::draco_asset(sequential);
    for (std::size_t at = 0; at < good.binary.size(); ++at)
      for (const int flip : flips) {
        GltfAsset bad = good;
        bad.binary[at] = static_cast<std::uint8_t>(bad.binary[at] ^ flip);
        expect_sound_or_refused(bad, folder / "f.glb", "byte " + std::to_string(at) + " ^ " + std::to_string(flip));
      }
  }
}

TEST(DracoStream, IsSoundOrRefusedWhicheverByteIsWrong) { expect_sound_or_refused_whichever_byte_is_wrong({1, 255}); }

// In `./tessera test --all`.
TEST(DracoStream, IsSoundOrRefusedWhicheverByteIsWrongInSixWays) {
  expect_sound_or_refused_whichever_byte_is_wrong({1, 2, 8, 64, 128, 255});
}

}  // namespace
}  // namespace tessera::scene::gltf::gltf_container_test
