// Measures the cost of effects where they run, and the cost of their code where they do not.
//
//   tessera_elision_bench mover [ROUNDS]                          one object that covers a tenth of a still image,
//                                                                 beside all at rest and all moving
//   tessera_elision_bench effects [ROUNDS]                        each effect of the shipped captures: as it is, off,
//                                                                 forced everywhere
//   tessera_elision_bench static STATIC_PROGRAM PROGRAM [ROUNDS]  this build beside one with TESSERA_EFFECTS=static, on
//                                                                 captures at rest
//   tessera_elision_bench image CAPTURE FILE.png                which tiles of a frame ran motion, defocus and
//                                                                 displacement
//   tessera_elision_bench --check                                 small images, once: checks that the comparisons compare
//                                                                 equal things
//
// Seconds are processor time of the single rendering thread, so that a busy machine does not matter. Compared ways
// take turns in every round; the least of all rounds is reported, with the ratio to the first way. Programs report
// the user time of their process.
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/check.h"
#include "base/image_codec.h"
#include "base/parallel.h"
#include "base/thread_clock.h"
#include "bench/support/timing.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/captures.h"

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;
using scene::Capture;
using Sets = std::vector<std::string>;

struct Way {
  std::string name;
  std::function<double()> seconds;  // seconds of one run
};

struct Timing {
  double least, median;
};

// Runs all ways in turn, after one warm-up.
std::vector<Timing> take_turns(const std::vector<Way>& ways, int rounds) {
  std::vector<std::vector<double>> seconds(ways.size());
  for (int round = 0; round <= rounds; ++round)
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const double taken = ways[w].seconds();
      if (round > 0 || rounds == 0) seconds[w].push_back(taken);
    }
  std::vector<Timing> out;
  for (const std::vector<double>& all : seconds)
    out.push_back({*std::min_element(all.begin(), all.end()), median(all)});
  return out;
}

// One frame of a capture in one way.
class Shot {
 public:
  Shot(const Capture& capture, int frame, int width, int height, const Sets& sets) : frame_(frame) {
    gpu::RunSettings settings;
    settings.output.machine_model = false;
    gpu::GpuConfiguration gpu;
    for (const std::string& text : sets) gpu::apply_setting(text, settings, gpu);
    renderer_ =
        std::make_unique<gpu::Device>(capture, gpu, settings, gpu::RenderRequest{width, height, {0, 0, width, height}});
  }
  double render() {
    const double start = thread_seconds();
    gpu::FrameResult result = renderer_->render(frame_);
    const double taken = thread_seconds() - start;
    tiles_ = 0;
    for (const gpu::TileCounts& tile : result.maps.tiles) tiles_ += tile.moving_sub_patches > 0 ? 1 : 0;
    all_tiles_ = result.maps.tiles.size();
    color_ = std::move(result.targets.color.values);
    return taken;
  }
  const std::vector<float>& color() const { return color_; }
  double moving_share() const { return static_cast<double>(tiles_) / static_cast<double>(all_tiles_); }

 private:
  int frame_;
  std::unique_ptr<gpu::Device> renderer_;
  std::vector<float> color_;
  std::size_t tiles_ = 0, all_tiles_ = 1;
};

// A wall of bent patches across the image, and an object of the same patches in front of it that covers `share` of
// the image. Moving parts move 16 pixels during the shutter.
Capture wall(double share, bool wall_moves, bool object_moves) {
  Capture capture;
  capture.settings.frame_rate = capture.settings.shutter_close = 1;
  capture.settings.background = Vec3(0.1f);
  scene::Material grey;
  grey.double_sided = true;
  const int material = test::add_material(capture, grey);
  const auto sheet = [&](float half_x, float half_y, int columns, int rows, float z) {
    std::vector<Vec3> points;
    const float width = 2 * half_x / static_cast<float>(columns), height = 2 * half_y / static_cast<float>(rows);
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        for (Vec3 p :
             test::flat_patch({-half_x + width * static_cast<float>(i), -half_y + height * static_cast<float>(j), z},
                              {width, 0, 0}, {0, height, 0}))
          points.push_back(p + Vec3(0, 0, 0.02f * std::sin(9 * p.x) * std::sin(7 * p.y)));
    return test::patches(points, material);
  };
  // The camera sees 3.2 by 1.8 at a distance of 4.
  scene::Camera camera;
  camera.type = scene::Camera::Type::kOrthographic;
  camera.x_mag = 1.6f;
  camera.y_mag = 0.9f;
  const DVec3 way(16.0 * 3.2 / 640, 0, 0);
  const int back = test::add_node(capture, sheet(1.9f, 1.0f, 24, 14, 0));
  const auto side = static_cast<float>(std::sqrt(share));
  const int front = test::add_node(capture, sheet(1.6f * side, 0.9f * side, 8, 5, 1));
  if (wall_moves) test::add_motion(capture, back, way);
  if (object_moves) test::add_motion(capture, front, way);
  test::add_camera(capture, {0, 0, 4}, camera);
  return capture;
}

void bench_mover(int rounds, int width, int height) {
  const Capture still = wall(0.1, false, false), one = wall(0.1, false, true), all = wall(0.1, true, true);
  std::vector<Shot> shots;
  for (const Capture* capture : {&still, &one, &all}) shots.emplace_back(*capture, 0, width, height, Sets{});
  std::vector<Way> ways;
  for (std::size_t k = 0; k < shots.size(); ++k) ways.push_back({"", [&shots, k] { return shots[k].render(); }});
  const std::vector<Timing> t = take_turns(ways, rounds);
  TESSERA_CHECK(shots[0].moving_share() == 0 && shots[1].moving_share() > 0.05 && shots[1].moving_share() < 0.4 &&
                    shots[2].moving_share() > 0.95,
                "the scenes move where they say");
  fmt::print("| scene, {}x{} | tiles with motion | ms a frame (least) | median |\n|---|---|---|---|\n", width, height);
  const char* names[] = {"all at rest", "one object moves", "all moves"};
  for (std::size_t k = 0; k < 3; ++k)
    fmt::print("| {} | {:.0f} % | {:.1f} | {:.1f} |\n", names[k], 100 * shots[k].moving_share(), 1e3 * t[k].least,
               1e3 * t[k].median);
  const auto share = [&](double Timing::*which) { return 100 * (t[1].*which - t[0].*which) / (t[2].*which); };
  const auto added = [&](double Timing::*which) {
    return 100 * (t[1].*which - t[0].*which) / (t[2].*which - t[0].*which);
  };
  fmt::print(
      "\nOne object adds {:.1f} % of the cost of the frame in which all moves (medians: {:.1f} %), and {:.1f} % "
      "(medians: {:.1f} %) of the cost that motion adds to that frame.\n",
      share(&Timing::least), share(&Timing::median), added(&Timing::least), added(&Timing::median));
}

void bench_effects(int rounds, int width, int height) {
  struct Row {
    const char *capture, *effect;
  };
  fmt::print("| capture, {}x{} | effect | as it is, ms | off | forced everywhere |\n|---|---|---|---|---|\n", width,
             height);
  for (const Row& row : {Row{"flyby", "motion"}, Row{"stroll", "motion"}, Row{"serpent", "motion"},
                         Row{"vases", "motion"}, Row{"eggs", "motion"}, Row{"eggs", "defocus"}, Row{"vases", "defocus"},
                         Row{"eggs", "displacement"}, Row{"vases", "displacement"}}) {
    const Capture capture =
        scene::read_capture(fs::path(TESSERA_SOURCE_DIR) / "captures" / (std::string(row.capture) + ".glb"));
    const int frame = capture.settings.first_frame;
    std::vector<Shot> shots;
    for (const char* value : {"auto", "off", "on"})
      shots.emplace_back(capture, frame, width, height, Sets{fmt::format("effects.{}={}", row.effect, value)});
    std::vector<Way> ways;
    for (std::size_t k = 0; k < shots.size(); ++k) ways.push_back({"", [&shots, k] { return shots[k].render(); }});
    const std::vector<Timing> t = take_turns(ways, rounds);
    TESSERA_CHECK(shots[0].color() == shots[2].color(), "an effect forced on gives the same image");
    fmt::print("| {} | {} | {:.1f} | {:.1f} ({:+.1f} %) | {:.1f} ({:+.1f} %) |\n", row.capture, row.effect,
               1e3 * t[0].least, 1e3 * t[1].least, 100 * (t[1].least / t[0].least - 1), 1e3 * t[2].least,
               100 * (t[2].least / t[0].least - 1));
  }
}

// User seconds of one run of a program.
double run_program(const std::string& command) {
  const auto user = [] {
    rusage usage{};
    getrusage(RUSAGE_CHILDREN, &usage);
    return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
  };
  const double before = user();
  TESSERA_CHECK(std::system(command.c_str()) == 0, "the program runs");
  return user() - before;
}

void bench_static(const std::string& static_program, const std::string& program, int rounds) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("tessera_elision_{}", now());
  fmt::print(
      "| capture at rest, 640x360, 4 frames | static build, s | general build | ratio | ratio of medians "
      "|\n|---|---|---|---|---|\n");
  for (const char* name : {"flyby", "stroll", "serpent", "vases"}) {
    const auto command = [&](const std::string& which, const char* out) {
      return fmt::format(
          "{} replay {} --size 640x360 --frames 0:4 --threads 1 --quiet --no-report --set output.machine_model=off "
          "--set effects.motion=off --set effects.defocus=off --set effects.displacement=off --out {}",
          which, (fs::path(TESSERA_SOURCE_DIR) / "captures" / (std::string(name) + ".glb")).string(),
          (folder / out).string());
    };
    const std::vector<Timing> t =
        take_turns({{"static", [&] { return run_program(command(static_program, "static")); }},
                    {"general", [&] { return run_program(command(program, "general")); }}},
                   rounds);
    for (int frame = 0; frame < 4; ++frame) {
      const std::string file = fmt::format("frame_{:04d}.exr", frame);
      TESSERA_CHECK(std::system(fmt::format("cmp -s {} {}", (folder / "static" / file).string(),
                                            (folder / "general" / file).string())
                                    .c_str()) == 0,
                    "both builds give the same image");
    }
    fmt::print("| {} | {:.3f} | {:.3f} | {:.4f} | {:.4f} |\n", name, t[0].least, t[1].least, t[1].least / t[0].least,
               t[1].median / t[0].median);
  }
  fs::remove_all(folder);
}

// Draws a frame and, beside it, the effects of each tile as shares of its sub-patches: motion red, defocus green, displacement blue.
void draw_tiles(const std::string& name, const fs::path& file) {
  const Capture capture = scene::read_capture(fs::path(TESSERA_SOURCE_DIR) / "captures" / (name + ".glb"));
  constexpr int kWidth = 640, kHeight = 360;
  gpu::RunSettings settings;
  settings.output.machine_model = false;
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = 16;
  gpu::Device renderer(capture, gpu, settings, {kWidth, kHeight, {0, 0, kWidth, kHeight}});
  const gpu::FrameResult result = renderer.render(capture.settings.first_frame);
  const Image8 shown = shaders::to_display(result.targets.color, capture.settings.exposure);
  Image8 out(2 * kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto pixel = shown.at(x, y);
      const gpu::TileCounts& tile = result.maps.tiles[static_cast<std::size_t>(y / 16 * result.maps.columns + x / 16)];
      const std::uint64_t with[3] = {tile.moving_sub_patches, tile.defocused_sub_patches, tile.displaced_sub_patches};
      const int grey = (pixel[0] + pixel[1] + pixel[2]) / 6;
      for (std::size_t c = 0; c < 3; ++c) {
        out.at(x, y)[c] = pixel[c];
        const double share =
            tile.sub_patches == 0 ? 0 : static_cast<double>(with[c]) / static_cast<double>(tile.sub_patches);
        out.at(kWidth + x, y)[c] = static_cast<std::uint8_t>(grey / 2 + static_cast<int>(170 * share));
      }
    }
  write_png(file, out);
}

int run(const std::vector<std::string>& arguments) {
  const ThreadLimit one_thread(1);
  const auto rounds = [&](std::size_t at, int otherwise) {
    return arguments.size() > at ? std::max(1, std::atoi(arguments[at].c_str())) : otherwise;
  };
  const std::string part = arguments.empty() ? "" : arguments[0];
  if (part == "mover")
    bench_mover(rounds(1, 15), 640, 360);
  else if (part == "effects")
    bench_effects(rounds(1, 9), 640, 360);
  else if (part == "static" && arguments.size() > 2)
    bench_static(arguments[1], arguments[2], rounds(3, 9));
  else if (part == "image" && arguments.size() > 2)
    draw_tiles(arguments[1], arguments[2]);
  else if (part == "--check")
    bench_mover(0, 320, 180), bench_effects(0, 96, 54);
  else
    return fmt::print(stderr, "tessera_elision_bench: see the head of bench/gpu/elision_bench.cpp\n"), 2;
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) { return tessera::bench::run({argv + 1, argv + argc}); }
