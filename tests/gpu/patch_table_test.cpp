#include "gpu/patch_table.h"
#include "frontend/patch_record.h"
#include "scene/capture_reader.h"
#include "scene/procedure_patch.h"
#include "scene/view.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::gpu::patch_table_test {
namespace {

TEST(PatchTable, RecordsAreContiguous) {
  scene::Capture capture;
  test::add_node(capture, test::closed_patches(scene::kNone));
  test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}));
  test::add_camera(capture, {0, 0, 6});
  const scene::Assembly assembly = scene::assemble(capture);
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, 64, 64), {});
  constexpr std::uint64_t kFirst = 1000, kLine = 64;
  const PatchTable memory(assembly, kLine, kFirst);
  std::uint64_t offset = 0;
  for (std::uint32_t p = 0; p < assembly.patch_count(); ++p) {
    const std::uint64_t bytes =
        frontend::patch_record_bytes(assembly, p, false) + frontend::patch_attribute_bytes(assembly, p, false);
    EXPECT_EQ(bytes, p < 6 ? 32u + 192 : 32u + 36 + 4) << p;
    const PatchTable::Lines lines = memory.of_shading(*frame, p);
    EXPECT_EQ(lines.first, kFirst + offset / kLine);
    EXPECT_EQ(lines.end, kFirst + (offset + bytes + kLine - 1) / kLine);
    const PatchTable::Lines instance = memory.of_instance(p);
    EXPECT_EQ(instance.first, instance.end);
    offset += bytes;
  }
  EXPECT_EQ(memory.end(), kFirst + (offset + kLine - 1) / kLine);
}

// A point of a procedure needs the numbers of its piece alone, neither other pieces' numbers nor the points of an
// image.
TEST(PatchTable, ShadingAProcedureReadsTheNumbersOfAPoint) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("workshop"));
  const scene::Assembly assembly = scene::assemble(capture);
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, 64, 64), {});
  const PatchTable memory(assembly, 64, 0);
  std::uint64_t whole = 0, read = 0;
  for (std::uint32_t p = 0; p < assembly.patch_count(); ++p) {
    const scene::PosedDrawable& drawable = frame->drawable_of(p);
    if (drawable.procedure == nullptr) continue;
    const PatchTable::Lines lines = memory.of_shading(*frame, p), all = memory.of_geometry(*frame, p);
    EXPECT_LE(lines.end, all.end);
    EXPECT_LE(scene::procedure_point_bytes(*drawable.procedure),
              scene::procedure_record_bytes(*drawable.procedure, false));
    whole += all.end - all.first, read += lines.end - lines.first;
  }
  EXPECT_GT(read, 0u);
  EXPECT_LT(8 * read, whole);
}

TEST(PatchTable, InstancesShareRecordsAndHaveOneEach) {
  scene::Capture capture;
  const int node = test::add_node(capture, test::closed_patches(scene::kNone));
  for (int i = 0; i < 3; ++i) capture.nodes[static_cast<std::size_t>(node)].instances.emplace_back();
  test::add_camera(capture, {0, 0, 6});
  const scene::Assembly assembly = scene::assemble(capture);
  ASSERT_EQ(assembly.patch_count(), 18u);
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(capture, 64, 64), {});
  const PatchTable memory(assembly, 64, 0);
  for (std::uint32_t p = 0; p < 6; ++p)
    for (std::uint32_t i = 1; i < 3; ++i) {
      EXPECT_EQ(memory.of_shading(*frame, p).first, memory.of_shading(*frame, p + 6 * i).first);
      EXPECT_EQ(memory.of_instance(p + 6 * i).first, memory.of_instance(p).first + i);
    }
}

}  // namespace
}  // namespace tessera::gpu::patch_table_test
