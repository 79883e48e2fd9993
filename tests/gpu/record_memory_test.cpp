#include "gpu/record_memory.h"

#include <gtest/gtest.h>

#include "frontend/patch_record.h"
#include "tests/support/captures.h"
#include "tests/support/instances.h"

namespace tessera::gpu {
namespace {

TEST(RecordMemory, RecordsLieOneBehindTheOther) {
  scene::Capture capture;
  test::add_node(capture, test::closed_patches(scene::kNone));
  test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}));
  const scene::Assembly assembly = scene::assemble(capture);
  constexpr std::uint64_t kFirst = 1000, kLine = 64;
  const RecordMemory memory(assembly, kLine, kFirst);
  std::uint64_t offset = 0;
  for (std::uint32_t p = 0; p < assembly.patch_count(); ++p) {
    const std::uint64_t bytes =
        frontend::patch_record_bytes(assembly, p, false) + frontend::patch_attribute_bytes(assembly, p, false);
    EXPECT_EQ(bytes, p < 6 ? 32u + 192 : 32u + 36 + 4) << p;
    const RecordMemory::Lines lines = memory.of_patch(p);
    EXPECT_EQ(lines.first, kFirst + offset / kLine);
    EXPECT_EQ(lines.end, kFirst + (offset + bytes + kLine - 1) / kLine);
    const RecordMemory::Lines instance = memory.of_instance(p);
    EXPECT_EQ(instance.first, instance.end);
    offset += bytes;
  }
  EXPECT_EQ(memory.end(), kFirst + (offset + kLine - 1) / kLine);
}

TEST(RecordMemory, InstancesShareRecordsAndHaveOneEach) {
  scene::Capture capture;
  const int node = test::add_node(capture, test::closed_patches(scene::kNone));
  for (int i = 0; i < 3; ++i) capture.nodes[static_cast<std::size_t>(node)].instances.emplace_back();
  const scene::Assembly assembly = scene::assemble(capture);
  ASSERT_EQ(assembly.patch_count(), 18u);
  const RecordMemory memory(assembly, 64, 0);
  for (std::uint32_t p = 0; p < 6; ++p)
    for (std::uint32_t i = 1; i < 3; ++i) {
      EXPECT_EQ(memory.of_patch(p).first, memory.of_patch(p + 6 * i).first);
      EXPECT_EQ(memory.of_instance(p + 6 * i).first, memory.of_instance(p).first + i);
    }
}

}  // namespace
}  // namespace tessera::gpu
