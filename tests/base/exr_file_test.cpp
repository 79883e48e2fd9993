#include "base/exr_file.h"
#include "base/error.h"
#include "tests/support/tests.h"

namespace tessera::exr_file_test {
namespace {

TEST(ExrFile, ColourComesBackToHalfPrecisionAndKeepsValuesAboveOne) {
  const test::TemporaryFolder folder;
  Image image(5, 3, 4);
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = static_cast<float>(i) * 0.75f;  // exact in half up to 2048
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 4; ++c)
    channels.push_back({std::string(1, "RGBA"[c]), ExrChannel::Type::kHalf, image.values.data() + c, 4});
  write_exr(folder / "a.exr", 5, 3, channels);
  const Image back = read_exr(folder / "a.exr");
  ASSERT_TRUE(back.same_shape(image));
  EXPECT_EQ(back.values, image.values);
}

TEST(ExrFile, LightBeyondHalfPrecisionIsTheLargestThatThereIs) {
  const test::TemporaryFolder folder;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<float> values = {65504.0f, 65519.0f, 65520.0f, 1e5f, 3e38f, kInfinity, -1e5f, 2.0f};
  std::vector<ExrChannel> channels;
  for (const char* name : {"R", "G", "B"}) channels.push_back({name, ExrChannel::Type::kHalf, values.data(), 1});
  write_exr(folder / "a.exr", 8, 1, channels);
  const Image back = read_exr(folder / "a.exr");
  for (int x = 0; x < 8; ++x) {
    const float wanted = x < 6 ? 65504.0f : x == 6 ? -65504.0f : 2.0f;
    EXPECT_EQ(back.at(x, 0)[0], wanted) << values[static_cast<std::size_t>(x)];
  }
}

TEST(ExrFile, WritingIsDeterministic) {
  const test::TemporaryFolder folder;
  const std::vector<float> values(64, 0.1f);
  const std::vector<std::uint32_t> ids(64, 77);
  for (const char* name : {"a.exr", "b.exr"})
    write_exr(folder / name, 8, 8,
              {{"depth.Z", ExrChannel::Type::kFloat, values.data(), 1},
               {"patch.id", ExrChannel::Type::kUint, ids.data(), 1}});
  EXPECT_EQ(test::read_text(folder / "a.exr"), test::read_text(folder / "b.exr"));
}

TEST(ExrFile, OtherFilesAreRefused) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "a.exr", "no image");
  EXPECT_THROW(read_exr(folder / "a.exr"), InputError);
  EXPECT_THROW(read_exr(folder / "missing.exr"), InputError);
  const std::vector<float> values(4, 1.0f);
  write_exr(folder / "grey.exr", 2, 2, {{"Y", ExrChannel::Type::kHalf, values.data(), 1}});
  EXPECT_THROW(read_exr(folder / "grey.exr"), InputError);
}

TEST(ExrFile, EveryTruncationOfAFileIsRefused) {
  const test::TemporaryFolder folder;
  const std::vector<float> values(3 * 16, 0.5f);
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 3; ++c)
    channels.push_back({std::string(1, "RGB"[c]), ExrChannel::Type::kHalf, values.data() + c, 3});
  write_exr(folder / "a.exr", 4, 4, channels);
  const std::string whole = test::read_text(folder / "a.exr");
  for (std::size_t length = 0; length < whole.size(); length += 3) {
    test::write_text(folder / "b.exr", whole.substr(0, length));
    EXPECT_THROW(read_exr(folder / "b.exr"), InputError) << length;
  }
}

// A display window that says it has one byte: OpenEXR would take sixteen, and the bytes behind it for the next size to
// allocate.
TEST(ExrFile, AnAttributeOfAnotherLengthThanItsTypeIsRefusedBeforeOpenExrReadsIt) {
  const test::TemporaryFolder folder;
  const std::vector<float> values(3, 0.5f);
  const auto channel = [&](const char* name, std::size_t c) {
    return ExrChannel{name, ExrChannel::Type::kHalf, values.data() + c, 3};
  };
  const auto file = folder / "picture.exr";
  write_exr(file, 1, 1, {channel("R", 0), channel("G", 1), channel("B", 2)});
  const std::string good = test::read_text(file);
  for (const std::string attribute : {"displayWindow", "dataWindow"})
    for (const char length : {1, 15, 17, 127}) {
      std::string bad = good;
      bad[bad.find(attribute) + attribute.size() + 1 + sizeof "box2i"] = length;
      test::write_text(file, bad);
      EXPECT_THROW(read_exr(file), InputError) << attribute << " " << static_cast<int>(length);
    }
  // A list of channels that ends before the length that it says.
  std::string early = good;
  early[early.find("chlist") + 11] = '\0';
  test::write_text(file, early);
  EXPECT_THROW(read_exr(file), InputError);
  // An attribute of an unknown type that promises two gigabytes.
  std::string bad = good;
  bad.replace(bad.find("box2i"), 5, "boxxx");
  bad.replace(bad.find("boxxx") + 6, 4, std::string("\xFF\xFF\xFF\x7F"));
  test::write_text(file, bad);
  EXPECT_THROW(read_exr(file), InputError);
}

TEST(ExrFile, SizesBeyondTheLimitsAreRefusedBeforePixelsAreAllocated) {
  const test::TemporaryFolder folder;
  const std::vector<float> values(3 * 40 * 30, 0.5f);
  const auto channel = [&](const char* name, std::size_t c) {
    return ExrChannel{name, ExrChannel::Type::kHalf, values.data() + c, 3};
  };
  const auto file = folder / "picture.exr";
  write_exr(file, 40, 30, {channel("R", 0), channel("G", 1), channel("B", 2)});
  ImageLimits limits;
  limits.max_pixels = 40 * 30;
  EXPECT_EQ(read_exr(file, limits).width, 40);
  limits.max_pixels = 40 * 30 - 1;
  EXPECT_THROW(read_exr(file, limits), LimitError);
  limits = {};
  limits.max_side = 39;
  EXPECT_THROW(read_exr(file, limits), LimitError);
}

TEST(ExrFile, AFolderThatCannotBeMadeIsReportedAndNothingIsLeft) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "file", "");
  const std::vector<float> values(4, 1.0f);
  EXPECT_THROW(write_exr(folder / "file" / "a.exr", 2, 2, {{"Y", ExrChannel::Type::kHalf, values.data(), 1}}),
               SystemError);
}

}  // namespace
}  // namespace tessera::exr_file_test
