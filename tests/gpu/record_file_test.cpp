// Records of frames: their files, and the keys that change them.
#include "gpu/record_file.h"
#include "base/error.h"
#include "gpu/device.h"
#include "tests/support/tests.h"
#include "timing/work_code.h"

namespace tessera::gpu::record_file_test {
namespace {

// Patches with heights, a texture and blending, in motion.
scene::Capture small_scene() {
  scene::Capture capture;
  scene::Material bumpy, clear;
  bumpy.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.2f, 0);
  clear.alpha_mode = scene::AlphaMode::kBlend;
  clear.base_color = {0.8f, 0.3f, 0.2f, 0.5f};
  const int node = test::add_node(capture, test::closed_patches(test::add_material(capture, bumpy)), {-0.6, 0, 0});
  test::add_node(capture, test::closed_patches(test::add_material(capture, clear)), {0.7, 0.2, 1});
  test::add_motion(capture, node, {1, 0, 0});
  test::add_camera(capture, {0, 0, 6});
  return capture;
}

timing::FrameWork record(const scene::Capture& capture, const GpuConfiguration& gpu, int frame = 0) {
  RenderRequest request{96, 80, {0, 0, 96, 80}};
  request.record_items = true;
  Device device(capture, gpu, RunSettings(), request);
  return std::move(device.render(frame).model->record.work);
}

// The record depends on no key of timing.
TEST(Record, TimingKeysLeaveItAlone) {
  const scene::Capture capture = small_scene();
  const std::string bytes = timing::encode(record(capture, {}));
  int keys = 0;
  for (const auto& key : gpu_keys().keys()) {
    if (!key.timing) continue;
    ++keys;
    GpuConfiguration gpu;
    const KeyValue value = gpu_keys().value(gpu, key);
    for (const double factor : {0.5, 2.0}) {
      if (std::holds_alternative<std::string>(value))
        key.set(gpu, std::string(key.choices.back()));
      else if (const auto* whole = std::get_if<std::int64_t>(&value))
        key.set(gpu, static_cast<std::int64_t>(std::clamp(static_cast<double>(*whole) * factor, key.min, key.max)));
      else
        key.set(gpu, std::clamp(std::get<double>(value) * factor, key.min, key.max));
      EXPECT_EQ(timing::encode(record(capture, gpu)), bytes) << key.name;
    }
  }
  EXPECT_GE(keys, 40);
}

// A twin for each kind of key that is functional although it looks like a speed.
TEST(Record, FunctionalKeysChangeIt) {
  const scene::Capture capture = small_scene();
  const std::string bytes = timing::encode(record(capture, {}));
  for (const auto& [name, value] :
       {std::pair{"shader.warp_lanes", 16}, std::pair{"l2.bytes", 0}, std::pair{"tile.width", 16}}) {
    GpuConfiguration gpu;
    const auto* key = gpu_keys().find(name);
    ASSERT_FALSE(key->timing);
    gpu_keys().set(gpu, *key, value);
    EXPECT_NE(timing::encode(record(capture, gpu)), bytes) << name;
    EXPECT_NE(functional_json(gpu, {}), functional_json({}, {})) << name;
  }
}

class RecordFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::vector<timing::FrameWork>& frames) {
    const std::filesystem::path file = folder_ / "frames.record";
    RecordWriter writer(file, record_head("small", {}, {}, {}, 96, 80));
    for (std::size_t f = 0; f < frames.size(); ++f) writer.add(static_cast<int>(f) + 3, {&frames[f]});
    writer.commit();
    return file;
  }
  // Reads to the end.
  static std::size_t read_all(const std::filesystem::path& file) {
    RecordReader reader(file);
    std::size_t frames = 0;
    while (reader.next()) ++frames;
    return frames;
  }

  test::TemporaryFolder folder_;
};

TEST_F(RecordFile, ReadsBackTheWrittenFrames) {  // RF1
  const scene::Capture capture = small_scene();
  const std::vector<timing::FrameWork> frames = {record(capture, {}, 0), record(capture, {}, 1)};
  const std::filesystem::path file = write(frames);
  RecordReader reader(file);
  EXPECT_EQ(reader.head()["capture"], "small");
  EXPECT_EQ(functional_json(recorded_machine(reader.head(), "x").gpu, recorded_machine(reader.head(), "x").settings),
            reader.head()["function"]);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const auto frame = reader.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->frame, static_cast<int>(f) + 3);
    ASSERT_EQ(frame->views.size(), 1u);
    EXPECT_EQ(timing::encode(frame->views[0]), timing::encode(frames[f]));
  }
  EXPECT_FALSE(reader.next());
}

TEST_F(RecordFile, RefusesCutAndDamagedFiles) {  // RF2
  const std::filesystem::path file = write({record(small_scene(), {})});
  const std::string bytes = test::read_text(file);
  for (std::size_t size = 0; size < bytes.size(); size += size < 40 || size + 40 > bytes.size() ? 1 : 97) {
    test::write_text(file, bytes.substr(0, size));
    EXPECT_THROW(read_all(file), InputError) << size;
  }
  // Damage behind the head is found; where it is not, all of it is work.
  const std::size_t head = bytes.find("\nF") + 1;
  test::Random random(7);
  for (int trial = 0; trial < 300; ++trial) {
    std::string damaged = bytes;
    damaged[head + static_cast<std::size_t>(random.integer(0, static_cast<int>(bytes.size() - head) - 1))] ^=
        static_cast<char>(1 << random.integer(0, 7));
    test::write_text(file, damaged);
    try {
      read_all(file);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("byte "));
    } catch (const LimitError&) {
    }
  }
  for (const char* other : {"tessera.record/1\n", "tessera.record/2\n", "tessera.record/3\n", "tessera.record/4\n"}) {
    test::write_text(file, other);
    try {
      read_all(file);
      ADD_FAILURE() << "a record of another version";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("record it again"));
    }
  }
  // An event that this machine does not charge.
  std::string renamed = bytes;
  renamed.replace(bytes.find("\"bounds\""), 8, "\"bouncs\"");
  test::write_text(file, renamed);
  try {
    read_all(file);
    ADD_FAILURE() << "a record of other events";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("record it again"));
  }
  test::write_text(file, "tessera.record/5\n");
  EXPECT_THROW(read_all(file), InputError);
  EXPECT_THROW(read_all(folder_ / "none"), InputError);
}

// Work that would be simulated without end.
TEST_F(RecordFile, RefusesImpossibleWork) {  // RF2
  const timing::FrameWork plain = record(small_scene(), {});
  const auto refused = [&](const auto& change) {
    timing::FrameWork work = plain;
    change(work);
    const std::filesystem::path file = write({work});
    EXPECT_THROW(read_all(file), InputError);
  };
  refused([](timing::FrameWork& w) { w.rounds[0].tiles[0].events[hardware::Event::kPixels] = std::uint64_t{1} << 40; });
  refused([](timing::FrameWork& w) { w.rounds[0].items[0].list_bytes = std::uint64_t{1} << 50; });
  refused([](timing::FrameWork& w) { w.rounds[0].geometry.written_bytes = w.rounds[0].geometry.dram_bytes + 1; });
  refused([](timing::FrameWork& w) { w.other_bytes = std::uint64_t{1} << 50; });
  EXPECT_EQ(read_all(write({plain})), 1u);
}

TEST_F(RecordFile, RefusesFramesBeyondTheLimit) {  // RF2
  const std::filesystem::path file = write({record(small_scene(), {})});
  RecordReader reader(file, 1000);
  EXPECT_THROW(reader.next(), LimitError);
}

TEST_F(RecordFile, NamesTheKeyThatWouldHaveMadeAnother) {
  const nlohmann::json head = record_head("small", {}, {}, {}, 96, 80);
  GpuConfiguration gpu;
  RunSettings settings;
  gpu.clock_mhz = 500;
  check_same_function(head, gpu, settings);
  gpu.tile.width = 16;
  try {
    check_same_function(head, gpu, settings);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("tile.width: the record was made with 32, not 16"));
  }
}

}  // namespace
}  // namespace tessera::gpu::record_file_test
