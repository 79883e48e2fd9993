// Ids of the surface that each pixel shows, which reports ask for, against the layers of the EXR file and closed
// forms.
#include <map>

#include "gpu/device.h"
#include "gpu/settings.h"
#include "scene/capture_reader.h"
#include "tests/support/captures.h"
#include "tests/support/tests.h"
#include "tilecore/pixel_ids.h"

namespace tessera::gpu::pixel_ids_test {
namespace {

using tilecore::PixelId;

FrameResult render(const scene::Capture& capture, const std::vector<std::string>& keys, int frame, bool ids = true) {
  RunSettings settings;
  GpuConfiguration gpu;
  for (const std::string& key : keys) apply_setting(key, settings, gpu);
  RenderRequest request{160, 90, {7, 5, 150, 81}};
  request.auxiliary = true;
  request.pixel_ids = ids;
  Device device(capture, gpu, settings, request);
  if (frame > 0) device.render(frame - 1);
  return device.render(frame);
}

std::vector<PixelId> ids_of(const tilecore::FrameTargets& targets) {
  std::vector<PixelId> out;
  for (int y = 0; y < targets.ids.height; ++y)
    for (int x = 0; x < targets.ids.width; ++x) out.push_back(PixelId::unpacked(targets.ids.at(x, y)));
  return out;
}

bool overlap(const scene::CellRange& a, const scene::CellRange& b) {
  return a.i0 < b.i1 && b.i0 < a.i1 && a.j0 < b.j1 && b.j0 < a.j1;
}

// Faults of ids beside the layers that the shader writes by itself; sub-patches of a base patch are the same or apart.
std::vector<std::string> faults(const std::vector<PixelId>& ids, const tilecore::FrameTargets& targets,
                                bool procedures) {
  std::set<std::string> out;
  std::map<std::uint32_t, std::set<std::array<std::uint8_t, 4>>> ranges;
  for (std::size_t p = 0; p < ids.size(); ++p) {
    const PixelId& id = ids[p];
    if (id.patch != targets.patch.values[p]) out.insert("patch");
    if (static_cast<float>(id.invocations) != targets.invocations.values[p]) out.insert("invocations");
    if (id.patch == 0 ? id.samples != 0 : id.samples < 1 || id.samples > 4) out.insert("samples");
    if ((id.layers == 0) != (id.nearest_layer == 0)) out.insert("layers");
    if (id.patch == 0) continue;
    // Procedures have no sub-patches.
    if (!procedures && (id.range.i0 >= id.range.i1 || id.range.j0 >= id.range.j1)) out.insert("empty");
    ranges[id.patch].insert({id.range.i0, id.range.j0, id.range.i1, id.range.j1});
  }
  for (const auto& [patch, of] : ranges)
    for (const auto& a : of)
      for (const auto& b : of)
        if (a != b && overlap({a[0], a[1], a[2], a[3]}, {b[0], b[1], b[2], b[3]})) out.insert("overlap");
  return {out.begin(), out.end()};
}

// Captures that move, blur, test alpha and blend; and a machine whose lists do not fit.
TEST(PixelIds, EqualTheLayersAndNameSubPatches) {
  for (const char* name : {"eggs", "vases", "garden", "workshop", "flyby"}) {
    const scene::Capture capture = scene::read_capture(test::shipped_capture(name));
    const bool procedures = name == std::string("workshop");
    for (const std::vector<std::string>& keys :
         std::vector<std::vector<std::string>>{{}, {"parameter_buffer.bytes=4096"}, {"resolve.desampling=adaptive"}}) {
      const FrameResult frame = render(capture, keys, 1);
      const std::vector<PixelId> ids = ids_of(frame.targets);
      EXPECT_EQ(faults(ids, frame.targets, procedures), std::vector<std::string>{})
          << name << " " << testing::PrintToString(keys);
      // The smallest fault is noticed.
      std::vector<PixelId> broken = ids;
      ++broken[broken.size() / 2].invocations;
      EXPECT_EQ(faults(broken, frame.targets, procedures), std::vector<std::string>{"invocations"});
    }
  }
}

TEST(PixelIds, DoNotHangOnPartialRendersOrOnTheFrameBefore) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("garden"));
  const std::vector<PixelId> ids = ids_of(render(capture, {}, 1).targets);
  for (const char* key : {"parameter_buffer.bytes=4096", "tile.rendering_elimination=true"})
    EXPECT_TRUE(ids == ids_of(render(capture, {key}, 1).targets)) << key;
}

TEST(PixelIds, ChangeNothingElse) {
  const scene::Capture capture = scene::read_capture(test::shipped_capture("vases"));
  const FrameResult with = render(capture, {}, 0), without = render(capture, {}, 0, false);
  EXPECT_EQ(with.targets.color.values, without.targets.color.values);
  EXPECT_EQ(with.counters.tilecore.triangle_table_bytes, without.counters.tilecore.triangle_table_bytes);
  EXPECT_TRUE(without.targets.ids.values.empty());
}

TEST(PixelIds, ArePackedWithoutLoss) {
  Random random(3);
  for (int k = 0; k < 1000; ++k) {
    const auto number = [&](int count) { return static_cast<std::uint32_t>(random.integer(0, count - 1)); };
    const auto byte = [&] { return static_cast<std::uint8_t>(number(256)); };
    const PixelId id{number(1 << 30), {byte(), byte(), byte(), byte()}, number(256), number(256), number(65536),
                     number(1 << 30)};
    EXPECT_EQ(PixelId::unpacked(id.packed()), id);
  }
  EXPECT_EQ(PixelId::unpacked(PixelId{1, {}, 300, 300, 70000, 0}.packed()), (PixelId{1, {}, 255, 255, 65535, 0}));
}

}  // namespace
}  // namespace tessera::gpu::pixel_ids_test
