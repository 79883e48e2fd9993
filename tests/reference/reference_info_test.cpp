// Information that is stored beside a reference: read back to the last bit, refused at its place where it is damaged.
#include "reference/reference_info.h"
#include "base/error.h"
#include "tests/support/tests.h"

namespace tessera::reference::reference_info_test {
namespace {

ReferenceInfo example() {
  ReferenceInfo info;
  info.samples = 512, info.asked_samples = 1024, info.enough_db = 47.7, info.edge_pixels = 0.1,
  info.triangles = 18446744073709551615u;
  info.rms_error = 1.0 / 3, info.psnr_db = 48.123456789012345;
  info.convergence = {40, 30, {4, 16}, {0.1, 0.05}, -0.5};
  info.host = {1.25, 2.5, 0.125};
  return info;
}

// Message of the refusal of this text, "" where it is read.
std::string fault_of(const std::string& text) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "r.json", text);
  try {
    read_reference_info(folder / "r.json");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ReferenceInfo, ComesBackToTheLastBit) {
  for (const bool measured : {true, false}) {
    ReferenceInfo info = example();
    if (!measured) info.enough_db = info.rms_error = info.psnr_db = info.convergence.slope = std::nullopt;
    const test::TemporaryFolder folder;
    test::write_text(folder / "r.json", reference_info_json(info).dump());
    EXPECT_EQ(read_reference_info(folder / "r.json"), info);
  }
}

TEST(ReferenceInfo, IsRefusedWithoutAnyOfItsMembers) {
  const json whole = reference_info_json(example());
  for (const char* group : {"", "/convergence", "/host"})
    for (const auto& [name, value] : whole[json::json_pointer(group)].items()) {
      json damaged = whole;
      damaged[json::json_pointer(group)].erase(name);
      EXPECT_THAT(fault_of(damaged.dump()), testing::HasSubstr(group + ("/" + name))) << "missing";
    }
  json damaged = whole;
  damaged["convergence"]["rms_error"].erase(0);
  EXPECT_THAT(fault_of(damaged.dump()), testing::HasSubstr("/convergence/rms_error"));
}

TEST(ReferenceInfo, IsRefusedAtTheMemberOfAnotherType) {
  const json whole = reference_info_json(example());
  for (const char* pointer :
       {"/samples", "/asked_samples", "/enough_db", "/edge_pixels", "/triangles", "/rms_error", "/psnr_db",
        "/convergence", "/convergence/size", "/convergence/size/1", "/convergence/samples/0", "/convergence/rms_error",
        "/convergence/slope", "/host", "/host/seconds"})
    for (const json& wrong : {json("text"), json(true), json(json::object())}) {
      if (wrong.is_object() && whole[json::json_pointer(pointer)].is_object()) continue;
      json damaged = whole;
      damaged[json::json_pointer(pointer)] = wrong;
      EXPECT_THAT(fault_of(damaged.dump()), testing::HasSubstr(pointer)) << wrong;
    }
  json damaged = whole;
  damaged["triangles"] = -1;
  EXPECT_THAT(fault_of(damaged.dump()), testing::HasSubstr("/triangles"));
  damaged = whole;
  damaged["samples"] = 4294967296u;
  EXPECT_THAT(fault_of(damaged.dump()), testing::HasSubstr("/samples"));
}

TEST(ReferenceInfo, IsRefusedAtEveryLengthThatIsNotItsOwn) {
  const std::string text = reference_info_json(example()).dump();
  for (std::size_t length = 0; length < text.size(); ++length)
    EXPECT_NE(fault_of(text.substr(0, length)), "") << length;
  EXPECT_NE(fault_of(text + "}"), "");
  EXPECT_NE(fault_of(text + std::string(2 << 20, ' ')), "") << "a megabyte of blanks";
}

}  // namespace
}  // namespace tessera::reference::reference_info_test
