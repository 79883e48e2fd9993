#include "reference/reference_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>

#include "base/check.h"
#include "base/parallel.h"
#include "gpu/view_inputs.h"
#include "reference/reference_kernel.h"
#include "reference/shadow_rays.h"
#include "scene/limits.h"
#include "tilecore/shading/alpha_test.h"
#include "tilecore/shading/transmission.h"
#include "tilecore/visibility/pattern_settings.h"

namespace tessera::reference {
namespace {

using tilecore::SurfaceLocation;

// One sample: place in the pixel, time, and point of the unit disc on the lens.
struct Sample {
  double x, y, t, u, v;
};

// Steele, Lea and Flood 2014, the finaliser of SplitMix64.
constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

Sample random_sample(std::uint64_t seed, std::uint64_t pixel, std::uint64_t sample) {
  constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15u;
  std::uint64_t state = mix64(mix64(seed * kGolden + pixel) + sample * kGolden);
  const auto next = [&state] { return static_cast<double>(mix64(state += kGolden) >> 11) * 0x1p-53; };
  Sample s;
  s.x = next();
  s.y = next();
  s.t = next();
  const double radius = std::sqrt(next()), angle = 2.0 * std::numbers::pi * next();
  s.u = radius * std::cos(angle);
  s.v = radius * std::sin(angle);
  return s;
}

// Order in which samples are put into packets: bits of each dimension, most for the dimensions along which rays
// differ more. It affects only the order of work.
struct PacketOrder {
  std::array<int, 5> bits{};  // x, y, t, u, v

  PacketOrder(const ReferenceScene& scene, std::size_t samples) {
    std::array<double, 5> extent = {1.0, 1.0, scene.mean_travel_pixels, 2.0 * scene.mean_confusion_pixels,
                                    2.0 * scene.mean_confusion_pixels};
    for (std::size_t cells = 1; cells * RayPacket::kRays < samples; cells *= 2) {
      const auto widest = static_cast<std::size_t>(std::max_element(extent.begin(), extent.end()) - extent.begin());
      extent[widest] *= 0.5;
      ++bits[widest];
    }
  }
  std::uint32_t cell(const Sample& s) const {
    const std::array<double, 5> unit = {s.x, s.y, s.t, 0.5 + 0.5 * s.u, 0.5 + 0.5 * s.v};
    std::uint32_t cell = 0;
    for (std::size_t d = 0; d < 5; ++d) {
      const double most = static_cast<double>((1u << bits[d]) - 1u);
      cell = cell << bits[d] | static_cast<std::uint32_t>(std::clamp(std::floor(unit[d] * (most + 1.0)), 0.0, most));
    }
    return cell;
  }
};

// Renders one pixel on one thread.
class PixelRenderer {
 public:
  // The part of the frame's shutter that is the scene's whole shutter.
  struct Part {
    double begin = 0, end = 1;
  };
  // `lighting`: the request's; with shadows the renderer adds the lights' shares to it. `shadows`: nullptr without shadows.
  void render(const ReferenceScene& scene, const ShadowScene* shadows, const Part& part,
              const ReferenceRequest& request, tilecore::Lighting& lighting, const PacketOrder& order, int px, int py,
              std::size_t from, std::size_t count) {
    samples_.resize(count);
    color_.resize(count);
    order_.clear();
    const auto pixel = static_cast<std::uint64_t>(py) * static_cast<std::uint64_t>(scene.frame.request.width) +
                       static_cast<std::uint64_t>(px);
    for (std::size_t k = from; k < count; ++k) {
      samples_[k] = request.pattern == nullptr ? random_sample(request.seed, pixel, k)
                                               : pattern_sample(*request.pattern, px, py, static_cast<int>(k));
      color_[k] = Vec3(0.0f);
      double& t = samples_[k].t;
      if (t < part.begin || t >= part.end) continue;
      t = (t - part.begin) / (part.end - part.begin);
      const auto code = static_cast<int>(std::floor(samples_[k].t * ShutterSegment::kCodes));
      if (code >= scene.posed.part.first && code < scene.posed.part.end)
        order_.emplace_back(order.cell(samples_[k]), static_cast<std::uint32_t>(k));
    }
    std::sort(order_.begin(), order_.end());
    seen_.clear();
    invocations_.clear();
    receivers_.clear();
    for (std::size_t first = 0; first < order_.size(); first += RayPacket::kRays) {
      fill_packet(scene, px, py, first);
      trace_packet(scene, packet_);
      for (std::size_t r = 0; r < RayPacket::kRays && first + r < order_.size(); ++r) {
        const std::size_t k = order_[first + r].second;
        seen_.push_back(see(scene, request, r, samples_[k].t));
      }
    }
    points_.resize(invocations_.size());
    if (shadows != nullptr) {
      shadow_tracer_.trace(*shadows, receivers_, shares_);
      lighting.known_shadows = &shares_;
    }
    shader_.shade(scene.frame, lighting, invocations_, points_);
    for (std::size_t i = 0; i < seen_.size(); ++i) color_[order_[i].second] = composed(seen_[i]);
  }
  // Colours of samples from `from` on; black where a sample is outside the scene's part of the shutter.
  const std::vector<Vec3>& color() const { return color_; }

 private:
  static Sample pattern_sample(const tilecore::SamplePattern& pattern, int px, int py, int k) {
    const auto offset = pattern.offset(k);
    const auto lens = pattern.lens(px, py, k);
    return {static_cast<double>(offset.x), static_cast<double>(offset.y), static_cast<double>(pattern.t(px, py, k)),
            static_cast<double>(lens.u), static_cast<double>(lens.v)};
  }

  void fill_packet(const ReferenceScene& scene, int px, int py, std::size_t first) {
    for (std::size_t r = 0; r < RayPacket::kRays; ++r) {
      const Sample& s = samples_[order_[std::min(first + r, order_.size() - 1)].second];
      const double x = static_cast<double>(px) + s.x - scene.center_x,
                   y = static_cast<double>(py) + s.y - scene.center_y;
      const double u = s.u * scene.lens_scale, v = s.v * scene.lens_scale, tilt_x = u * scene.inverse_focus,
                   tilt_y = v * scene.inverse_focus;
      const ShutterSegment& part = scene.posed.part;
      packet_.t[r] = part.whole() ? s.t : (s.t - part.at(0)) / (part.at(1) - part.at(0));
      packet_.origin_x[r] = scene.orthographic ? x + u : u;
      packet_.origin_y[r] = scene.orthographic ? y + v : v;
      packet_.direction_x[r] = scene.orthographic ? -tilt_x : x - tilt_x;
      packet_.direction_y[r] = scene.orthographic ? -tilt_y : y - tilt_y;
    }
  }

  // World direction of a packet's ray far away: the inverse of the mixed poses of the camera, as distant points move.
  static Vec3 background_direction(const ReferenceScene& scene, const RayPacket& packet, std::size_t r) {
    const scene::Projection& p = scene.posed.projection;
    const double t = packet.t[r];
    const DVec3 along(packet.direction_x[r] / p.scale, -packet.direction_y[r] / p.scale, -1.0);
    const auto& views = scene.posed.views;
    const DMat3 to_camera = DMat3(views[0].world_to_camera) * (1.0 - t) + DMat3(views[1].world_to_camera) * t;
    return Vec3(glm::normalize(glm::inverse(to_camera) * along));
  }

  // The result of a sample: the opaque surface or the background, and the layers over it from far to near, which
  // follow the surface in invocations_.
  struct Seen {
    bool surface = false;
    Vec3 behind{0.0f};
    std::uint32_t first = 0, layers = 0;
  };

  // Requests the shading of the point that ray `r` sees at a depth, and its shadows.
  void ask_for(const ReferenceScene& scene, std::size_t r, std::int64_t number, double depth, double b1, double b2,
               double t) {
    invocations_.push_back({scene.location(number, b1, b2, t), static_cast<float>(t)});
    const ReferenceScene::Triangle& triangle = scene.triangles[static_cast<std::size_t>(number)];
    receivers_.push_back({DVec3(packet_.origin_x[r] + depth * packet_.direction_x[r],
                                packet_.origin_y[r] + depth * packet_.direction_y[r], depth),
                          packet_.t[r], t, triangle.patch, triangle.triangle});
  }

  Vec3 composed(const Seen& seen) const {
    std::size_t at = seen.first;
    Vec3 color = seen.surface ? points_[at++].color : seen.behind;
    for (std::uint32_t layer = 0; layer < seen.layers; ++layer, ++at)
      color = color * (1.0f - points_[at].alpha) + points_[at].color * points_[at].alpha;
    return color;
  }

  static bool blends(const ReferenceScene& scene, std::int64_t triangle) {
    return scene.frame.drawable_of(scene.triangles[static_cast<std::size_t>(triangle)].patch).material->alpha_mode ==
           scene::AlphaMode::kBlend;
  }

  // Finds the nearest surface that is opaque or passes its alpha test, then the layers over it from far to near. `t`:
  // time of the whole shutter.
  Seen see(const ReferenceScene& scene, const ReferenceRequest& request, std::size_t r, double t) {
    const scene::FrameGeometry& frame = scene.frame;
    double depth = packet_.depth[r];
    std::int64_t number = packet_.triangle[r];
    double b1 = packet_.b1[r], b2 = packet_.b2[r];
    layers_.clear();
    for (const RayPacket::Crossing& c : packet_.crossings)
      if (c.ray == r && (c.depth < depth || (c.depth == depth && (blends(scene, c.triangle) || c.triangle < number))))
        layers_.push_back(c);
    // Sorts from near to far. At the same depth blended layers lie on opaque ones, and later triangles on earlier ones.
    std::sort(layers_.begin(), layers_.end(), [&](const auto& a, const auto& b) {
      if (a.depth != b.depth) return a.depth < b.depth;
      const bool a_blends = blends(scene, a.triangle);
      if (a_blends != blends(scene, b.triangle)) return a_blends;
      return a_blends ? a.triangle > b.triangle : a.triangle < b.triangle;
    });
    const auto masked = std::find_if(layers_.begin(), layers_.end(), [&](const RayPacket::Crossing& c) {
      const scene::Material& material =
          *frame.drawable_of(scene.triangles[static_cast<std::size_t>(c.triangle)].patch).material;
      return material.alpha_mode == scene::AlphaMode::kMask &&
             tilecore::point_alpha(frame, scene.location(c.triangle, c.b1, c.b2, t)) >= material.alpha_cutoff;
    });
    if (masked != layers_.end()) {
      number = masked->triangle, depth = masked->depth, b1 = masked->b1, b2 = masked->b2;
      layers_.erase(masked, layers_.end());
    }
    Seen seen;
    seen.first = static_cast<std::uint32_t>(invocations_.size());
    seen.surface = number != RayPacket::kNothing;
    if (seen.surface)
      ask_for(scene, r, number, depth, b1, b2, t);
    else if (request.background)
      seen.behind = *request.background;
    else
      seen.behind = request.lighting.environment.background(background_direction(scene, packet_, r));
    for (auto layer = layers_.rbegin(); layer != layers_.rend(); ++layer) {
      if (!blends(scene, layer->triangle)) continue;
      ask_for(scene, r, layer->triangle, layer->depth, layer->b1, layer->b2, t);
      ++seen.layers;
    }
    return seen;
  }

  RayPacket packet_;
  std::vector<Seen> seen_;  // in the order of order_
  std::vector<tilecore::Invocation> invocations_;
  std::vector<ShadowReceiver> receivers_;  // in the order of invocations_
  ShadowTracer shadow_tracer_;
  tilecore::KnownShadows shares_;
  std::vector<tilecore::ShadedPoint> points_;
  tilecore::PixelShader shader_;
  std::vector<Sample> samples_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order_;  // cell, sample
  std::vector<Vec3> color_;
  std::vector<RayPacket::Crossing> layers_;
};

std::vector<int> sample_numbers(const ReferenceRequest& request) {
  std::vector<int> numbers =
      request.pattern == nullptr ? request.samples : std::vector<int>{request.pattern->samples_per_pixel()};
  TESSERA_CHECK(!numbers.empty() && numbers.front() > 0 && std::is_sorted(numbers.begin(), numbers.end()),
                "numbers of samples ascend");
  return numbers;
}

// Images in progress: sums of each pixel's first colours, image by image. They are made in rounds; each round adds
// the next samples.
class Sums {
 public:
  Sums(const scene::FrameGeometry& frame, const ReferenceRequest& request)
      : numbers_(sample_numbers(request)), width_(frame.request.width), height_(frame.request.height) {}

  // Begins a round that makes `count` more images.
  void begin_round(std::size_t count) {
    first_ = images_.size();
    const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    images_.resize(first_ + count, first_ > 0 ? images_.back() : std::vector<DVec3>(pixels, DVec3(0.0)));
  }
  std::size_t from() const { return first_ == 0 ? 0 : static_cast<std::size_t>(numbers_[first_ - 1]); }
  std::size_t to() const { return static_cast<std::size_t>(numbers_[images_.size() - 1]); }
  IntRect pixels() const { return {0, 0, width_, height_}; }
  // Number of images, the round's included.
  std::size_t count() const { return images_.size(); }
  const std::vector<int>& numbers() const { return numbers_; }

  // Adds the colours of samples from from() on.
  void add(int x, int y, const std::vector<Vec3>& color) {
    for (std::size_t n = first_; n < images_.size(); ++n) {
      DVec3& sum = images_[n][pixels().index(x, y)];
      for (std::size_t k = from(); k < static_cast<std::size_t>(numbers_[n]); ++k) sum += DVec3(color[k]);
    }
  }
  // Removes the round's contribution to some pixels.
  void take_back(const IntRect& area) {
    for (std::size_t n = first_; n < images_.size(); ++n)
      for (int y = area.y0; y < area.y1; ++y)
        for (int x = area.x0; x < area.x1; ++x) {
          const std::size_t pixel = pixels().index(x, y);
          images_[n][pixel] = first_ > 0 ? images_[first_ - 1][pixel] : DVec3(0.0);
        }
  }

  Image mean(std::size_t n) const {
    Image image(width_, height_, 3);
    for (std::size_t pixel = 0; pixel < images_[n].size(); ++pixel)
      for (std::size_t c = 0; c < 3; ++c)
        image.values[3 * pixel + c] = static_cast<float>(images_[n][pixel][static_cast<int>(c)] / numbers_[n]);
    return image;
  }

 private:
  std::vector<int> numbers_;
  int width_, height_;
  std::size_t first_ = 0;  // first image of the round
  std::vector<std::vector<DVec3>> images_;
};

// Makes all images at once or, if `enough` may end the work, one after another. add(sums) adds a round.
template <class Add>
std::vector<Image> make_images(const scene::FrameGeometry& frame, const ReferenceRequest& request, const Add& add) {
  Sums sums(frame, request);
  std::vector<Image> images;
  const std::size_t count = sums.numbers().size();
  while (images.size() < count) {
    sums.begin_round(request.enough ? 1 : count);
    add(sums);
    while (images.size() < sums.count()) images.push_back(sums.mean(images.size()));
    if (request.enough && request.enough(images)) break;
  }
  return images;
}

// A scene and the part of the frame's shutter that it covers.
struct ScenePart {
  const ReferenceScene& scene;
  PixelRenderer::Part part;
  const ShadowScene* shadows = nullptr;  // nullptr if no light casts shadows
};

// Adds samples of all scenes, which have the pixels of the first one's region.
void add_samples(std::span<const ScenePart> scenes, const ReferenceRequest& request, Sums& sums) {
  const ReferenceScene& scene = scenes.front().scene;
  const IntRect pixels = scene.region.pixels();
  const PacketOrder order(scene, sums.to() - sums.from());
  double shutter = 0;
  for (const ScenePart& one : scenes) shutter += one.part.end - one.part.begin;
  PerThread<PixelRenderer> renderers;
  constexpr int kRun = 16;  // pixels that a thread takes at a time
  const std::size_t runs = static_cast<std::size_t>((pixels.width() + kRun - 1) / kRun);
  parallel_for(runs * static_cast<std::size_t>(pixels.height()), [&](std::size_t run) {
    PixelRenderer& renderer = renderers.local();
    const int y = pixels.y0 + static_cast<int>(run / runs), x0 = pixels.x0 + static_cast<int>(run % runs) * kRun,
              x1 = std::min(x0 + kRun, pixels.x1);
    tilecore::Lighting lighting = request.lighting;
    for (int x = x0; x < x1; ++x)
      for (const ScenePart& one : scenes) {
        renderer.render(one.scene, one.shadows, one.part, request, lighting, order, x, y, sums.from(), sums.to());
        sums.add(x, y, renderer.color());
      }
    if (request.finished) request.finished((x1 - x0) * static_cast<double>(sums.to() - sums.from()) * shutter);
  });
}

// The shadows of a scene, or nullptr.
std::unique_ptr<ShadowScene> shadows_of(const ReferenceScene& scene, const ReferenceRequest& request,
                                        scene::MemoryBudget* budget = nullptr) {
  if (!request.shadows) return nullptr;
  auto shadows = std::make_unique<ShadowScene>(scene, *request.shadows, budget);
  return shadows->any() ? std::move(shadows) : nullptr;
}

void add_scene(const ReferenceScene& scene, const ReferenceRequest& request, Sums& sums) {
  const std::unique_ptr<ShadowScene> shadows = shadows_of(scene, request);
  const ScenePart whole{scene, {}, shadows.get()};
  add_samples(std::span(&whole, 1), request, sums);
}

// Calls add(pixels) for all of an image or, if the scene of so many pixels needs more memory than is left, for halves
// of it. Pixels share no data, so the sums are the same.
template <class Add>
void add_in_parts(const IntRect& pixels, Sums& sums, const Add& add) {
  constexpr int kLeast = 16;  // least pixels along a side
  try {
    add(pixels);
    return;
  } catch (const scene::BudgetError&) {
    if (pixels.width() <= kLeast && pixels.height() <= kLeast) throw;
  }
  sums.take_back(pixels);
  IntRect first = pixels, second = pixels;
  if (pixels.width() > pixels.height())
    first.x1 = second.x0 = (pixels.x0 + pixels.x1) / 2;
  else
    first.y1 = second.y0 = (pixels.y0 + pixels.y1) / 2;
  add_in_parts(first, sums, add);
  add_in_parts(second, sums, add);
}

std::vector<Image> render_segments(const scene::FrameGeometry& frame, const ReferenceRequest& request, bool behind) {
  const int count = static_cast<int>(frame.segments.size());
  return make_images(frame, request, [&](Sums& sums) {
    add_in_parts(sums.pixels(), sums, [&](const IntRect& pixels) {
      for (int segment = count == 0 ? 0 : 1; segment <= count; ++segment) {
        const SampleRegion region(frame.segment(segment).projection, pixels);
        add_scene(ReferenceScene(frame, {.segment = segment, .behind = behind, .region = region}), request, sums);
      }
    });
  });
}

// An estimate of the memory that a posed slice takes: deformed vertices above all.
std::uint64_t posed_bytes(const scene::FrameGeometry& frame) {
  std::uint64_t bytes = frame.drawables.size() * sizeof(scene::PosedDrawable) +
                        frame.patterns.size() * (sizeof(scene::TessellationPattern) + sizeof(float));
  for (const scene::DrawnPrimitive& drawn : frame.assembly->drawn) {
    const scene::PosedDrawable& drawable = frame.drawables[drawn.first_drawable];
    if (drawable.deforming) bytes += 2 * drawable.positions[0].size() * (2 * sizeof(Vec3) + sizeof(Vec4));
  }
  return bytes;
}

// Poses and draws slices together, as many as fit kTogetherBytes: each looks at all of a pixel's samples.
void add_slices(const ShutterSlices& slices, const ReferenceRequest& request, bool behind, const IntRect& pixels,
                Sums& sums) {
  constexpr std::size_t kTogether = 64;
  constexpr std::uint64_t kTogetherBytes = std::uint64_t{256} << 20;
  const scene::Assembly& assembly = *slices.common().assembly;
  const scene::Capture& capture = *assembly.capture;
  for (std::size_t next = 0; next < slices.count();) {
    scene::MemoryBudget budget(capture.max_bytes, capture.file.string(), assembly.charged_bytes());
    const std::uint64_t used = budget.used_bytes(), enough = std::min(kTogetherBytes, budget.left_bytes() / 4);
    std::vector<std::unique_ptr<scene::FrameGeometry>> frames;
    std::vector<std::unique_ptr<ReferenceScene>> scenes;
    std::vector<std::unique_ptr<ShadowScene>> shadows;
    std::vector<ScenePart> parts;
    for (; next < slices.count() && parts.size() < kTogether && (parts.empty() || budget.used_bytes() - used < enough);
         ++next) {
      frames.push_back(slices.pose(next));
      budget.charge(1, posed_bytes(*frames.back()), "a posed slice of the reference's shutter");
      scenes.push_back(std::make_unique<ReferenceScene>(
          *frames.back(),
          ReferenceScene::Options{
              .behind = behind, .region = SampleRegion(frames.back()->projection, pixels), .budget = &budget}));
      // The last slice includes the end of the shutter.
      const bool last = next + 1 == slices.count();
      shadows.push_back(shadows_of(*scenes.back(), request, &budget));
      parts.push_back(
          {*scenes.back(), {slices.at(next), last ? 1.0 + 0x1p-52 : slices.at(next + 1)}, shadows.back().get()});
    }
    add_samples(parts, request, sums);
  }
}

std::vector<Image> render_slices(const ShutterSlices& slices, const ReferenceRequest& request, bool behind) {
  return make_images(slices.common(), request, [&](Sums& sums) {
    add_in_parts(sums.pixels(), sums,
                 [&](const IntRect& pixels) { add_slices(slices, request, behind, pixels, sums); });
  });
}

shaders::RadianceImage levels_of(const Image& pixels) {
  shaders::RadianceImage image(shaders::RadianceImage::mip_chain({pixels.width, pixels.height}));
  for (int y = 0; y < pixels.height; ++y)
    for (int x = 0; x < pixels.width; ++x)
      image.set(0, x, y, {pixels.at(x, y)[0], pixels.at(x, y)[1], pixels.at(x, y)[2]});
  for (int level = 1; level < image.level_count(); ++level)
    image.reduce(level, {0, 0, image.width(level), image.height(level)});
  return image;
}

}  // namespace

std::vector<Image> render_reference(const ReferenceScene& scene, const ReferenceRequest& request) {
  return make_images(scene.frame, request, [&](Sums& sums) { add_scene(scene, request, sums); });
}

namespace {

// render(request, behind) renders a frame or a shutter that shows the scene of `frame`.
template <class Render>
std::vector<Image> render_over_what_is_behind(const scene::FrameGeometry& frame, const ReferenceRequest& request,
                                              const Render& render) {
  if (!shows_what_is_behind(frame)) return render(request, false);
  ReferenceRequest first = request;
  first.enough = {};
  if (request.pattern == nullptr) first.samples = {request.samples.back()};
  const shaders::RadianceImage behind = levels_of(render(first, true).back());
  ReferenceRequest lit = request;
  lit.lighting.behind = &behind;
  return render(lit, false);
}

}  // namespace

bool shows_what_is_behind(const scene::FrameGeometry& frame) {
  return std::ranges::any_of(frame.drawables, [](const auto& drawable) { return tilecore::transmits(drawable); });
}

std::vector<Image> render_reference(const ShutterSlices& slices, const ReferenceRequest& request) {
  return render_over_what_is_behind(slices.common(), request, [&](const ReferenceRequest& asked, bool behind) {
    return render_slices(slices, asked, behind);
  });
}

Image render_machines_samples(const scene::Assembly& assembly, const gpu::GpuConfiguration& gpu,
                              const gpu::RunSettings& settings, int width, int height, int frame) {
  const scene::Capture& capture = *assembly.capture;
  const auto posed = scene::pose_frame(assembly, gpu::frame_camera(capture, settings, width, height),
                                       gpu::frame_request(capture, gpu, settings, width, height, frame));
  const tilecore::SamplePattern pattern(
      tilecore::sampling_settings(settings.sampling, gpu.tilecore.visibility, frame, posed->parts()));
  ReferenceRequest request;
  request.lighting = gpu::frame_lighting(capture);
  request.background = gpu::frame_background(capture);
  request.shadows = settings.shadows;
  request.pattern = &pattern;
  return std::move(render_reference(*posed, request).front());
}

std::vector<Image> render_reference(const scene::FrameGeometry& frame, const ReferenceRequest& request) {
  return render_over_what_is_behind(frame, request, [&](const ReferenceRequest& asked, bool behind) {
    return render_segments(frame, asked, behind);
  });
}

double rms_difference(const Image& a, const Image& b) {
  TESSERA_CHECK(a.same_shape(b) && !a.values.empty(), "images to compare have one shape");
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const double d = static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.values.size()));
}

double convergence_slope(const std::vector<int>& samples, const std::vector<double>& errors) {
  TESSERA_CHECK(samples.size() == errors.size() && samples.size() >= 2, "a slope needs two points");
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double x = std::log(static_cast<double>(samples[i])), y = std::log(errors[i]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace tessera::reference
