#include "gpu/frame_graph.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/round_up.h"
#include "gpu/attachment_stores.h"
#include "gpu/stored_arrays.h"
#include "gpu/tile_memory.h"
#include "gpu/view_inputs.h"
#include "scene/pass_graph.h"

namespace tessera::gpu {
namespace {

using scene::Attachment;
using scene::AttachmentFormat;
using scene::DrawFilter;
using scene::LoadAction;
using scene::Pass;
using scene::PassShader;
using scene::StoreAction;
using scene::Subpass;

std::optional<tilecore::FrameFormat> color_format(AttachmentFormat format) {
  if (format == AttachmentFormat::kRgba8) return tilecore::FrameFormat::kRgba8;
  if (format == AttachmentFormat::kRgb10A2) return tilecore::FrameFormat::kRgb10a2;
  if (format == AttachmentFormat::kRgba16F) return tilecore::FrameFormat::kRgba16f;
  return std::nullopt;
}

template <class Action>
std::optional<Action> action_of(const std::vector<std::pair<std::string, Action>>& actions, std::string_view name) {
  for (const auto& [attachment, action] : actions)
    if (attachment == name) return action;
  return std::nullopt;
}

bool draws(const Pass& pass) {
  return std::ranges::any_of(pass.subpasses, [](const Subpass& s) { return s.draw != DrawFilter::kNothing; });
}

// Whether a pass has a part of a shading path: tiles then hold the state of the path, whatever the attachments are.
bool shades_in_parts(const Pass& pass) {
  return std::ranges::any_of(pass.subpasses, [](const Subpass& s) {
    return s.shader == PassShader::kDepth || s.shader == PassShader::kGbuffer || s.shader == PassShader::kLight;
  });
}

}  // namespace

// Walks the passes in the order in which they run.
class FrameGraph::Reader {
 public:
  Reader(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings, IntRect region,
         const std::array<int, 2>& frame)
      : capture_(capture),
        graph_(*capture.settings.graph),
        gpu_(gpu),
        settings_(settings),
        frame_(frame),
        region_(region),
        whole_(region == IntRect{0, 0, frame[0], frame[1]}),
        pixels_(static_cast<std::uint64_t>(region.width()) * static_cast<std::uint64_t>(region.height())) {}

  void read(FrameGraph& out) {
    const std::vector<int> order = pass_order(graph_);
    for (const int number : order) check_tile(static_cast<std::size_t>(number));
    for (const int number : order) {
      pass_ = static_cast<std::size_t>(number);
      const PassShader shader = pass().subpasses[0].shader;
      if (shader == PassShader::kDepth)
        draw_depths(out);
      else if (shader == PassShader::kGbuffer)
        fill(out);
      else if (shader == PassShader::kLight)
        light(out);
      else if (draws(pass()))
        draw(out);
      else if (shader == PassShader::kTaa)
        taa(out);
      else if (shader == PassShader::kBloom)
        bloom(out);
      else
        copy(out);
    }
    if (colors_ != scene::kFrameAttachment) refuse("", "leaves the colours of its surfaces in {}", in_quotes(colors_));
    out.attachment_bytes_ = end_;
  }

 private:
  const Pass& pass() const { return graph_.passes[pass_]; }
  static std::string in_quotes(std::string_view name) { return "'" + escape_control(name, 60) + "'"; }

  [[noreturn]] void fault(std::size_t pass, const std::string& below, const std::string& text) const {
    throw InputError(capture_.file.string(), fmt::format("/extensions/TESSERA_capture/passes/{}{}", pass, below), text);
  }
  template <class... Args>
  [[noreturn]] void refuse(const std::string& below, fmt::format_string<Args...> text, Args&&... args) const {
    fault(pass_, below, fmt::format(text, std::forward<Args>(args)...));
  }
  std::string subpass(std::size_t number) const {
    return pass().lists_subpasses ? fmt::format("/subpasses/{}", number) : "";
  }

  void check_tile(std::size_t number) const {
    constexpr std::uint64_t kGeneralBytes = 20, kDepthBytes = 4;
    const std::uint64_t color_bytes = 8 + (velocity_of(graph_.passes[number]) == nullptr ? 0 : Taa::kVelocityBytes);
    auto bytes = static_cast<std::uint64_t>(tile_bytes_per_sample(
        graph_, graph_.passes[number], static_cast<int>(8 * frame_pixel_bytes(gpu_.frame_buffer.format))));
    const std::uint64_t samples = static_cast<std::uint64_t>(gpu_.tile.width) *
                                  static_cast<std::uint64_t>(gpu_.tile.height) *
                                  static_cast<std::uint64_t>(settings_.sampling.samples_per_pixel);
    // Colours take the place of the visibility record, which is smaller when weights have few bits.
    if (bytes == kGeneralBytes)
      bytes = std::max(tile_sample_bytes(gpu_, settings_) / samples, kDepthBytes + color_bytes);
    const std::uint64_t needed = samples * bytes;
    if (gpu_.tile.fit || shades_in_parts(graph_.passes[number])) return;
    if (needed > static_cast<std::uint64_t>(gpu_.cores.memory_bytes))
      fault(number, "",
            fmt::format("needs {} bytes of tile memory a sample: a tile of {}x{} pixels with {} samples takes {}, "
                        "tilecore.memory_bytes is {}",
                        bytes, gpu_.tile.width, gpu_.tile.height, settings_.sampling.samples_per_pixel, needed,
                        gpu_.cores.memory_bytes));
  }

  // ---- Passes that draw ----------------------------------------------------------------------------------------------

  void begin_drawing() const {
    if (!colors_.empty() || !parameters_.empty())
      refuse("", "draws after another pass has drawn: this machine renders one pass that draws");
    if (pass().view != scene::PassView::kCamera) refuse("/view", "is right: stereo.eye_separation renders both eyes");
  }

  void draw_depths(FrameGraph& out) {
    begin_drawing();
    if (prepass_) refuse("", "is a second pass of depths: this machine renders one");
    if (pass().subpasses.size() > 1) refuse("/subpasses/1", "follows depths in their pass: they have one of their own");
    if (pass().subpasses[0].draw == DrawFilter::kBlended)
      refuse(subpass(0) + "/draw", "is blended: depths that hide are those of opaque surfaces");
    check_depth(LoadAction::kClear, StoreAction::kStore, "a prepass clears its depths and stores every one");
    prepass_ = true;
    out.prepass_name_ = pass().name;
  }

  void draw(FrameGraph& out) {
    begin_drawing();
    std::vector<DrawFilter> drawn;
    for (std::size_t s = 0; s < pass().subpasses.size(); ++s) {
      const Subpass& one = pass().subpasses[s];
      if (maps_tones(s)) {
        map_on_chip(s);
        break;
      }
      if (one.shader != PassShader::kForward) refuse_shader(s, "a pass that draws colours runs forward");
      drawn.push_back(one.draw);
      check_target(s);
    }
    check_drawn(drawn);
    out.name_ = pass().name;
    out.actions_ = target_actions();
    const std::string depth(depth_attachment(graph_, pass()));
    const LoadAction wanted = prepass_ ? LoadAction::kLoad : LoadAction::kClear;
    if (action_of(pass().load, depth).value_or(LoadAction::kClear) != wanted)
      refuse("/load" + pointer_step(depth), "{}",
             prepass_ ? "does not load the depths of the pass before"
                      : "does not clear the depths: the frame would be another one");
    store_depth(out.actions_, depth);
    if (const std::string* velocity = velocity_of(pass()); velocity != nullptr) store_velocity(out.actions_, *velocity);
  }

  // The subpass that runs temporal antialiasing; nullptr if none does.
  const Subpass* antialiasing() const {
    for (const Pass& pass : graph_.passes)
      if (pass.subpasses[0].shader == PassShader::kTaa) return &pass.subpasses[0];
    return nullptr;
  }
  // The velocities that a pass writes for it; nullptr if it writes none.
  const std::string* velocity_of(const Pass& pass) const {
    if (!draws(pass)) return nullptr;
    const std::vector<std::string>& written = pass.subpasses[0].write;
    const auto found =
        std::ranges::find_if(written, [&](const std::string& name) { return is_velocity(graph_, name); });
    return found == written.end() ? nullptr : &*found;
  }

  void store_velocity(tilecore::AttachmentActions& actions, const std::string& velocity) {
    check_shape(subpass(0) + "/write", *graph_.find(velocity));
    if (action_of(pass().load, velocity).value_or(LoadAction::kClear) == LoadAction::kLoad)
      refuse("/load" + pointer_step(velocity), "loads velocities, which the pass writes in every pixel");
    if (action_of(pass().store, velocity) == StoreAction::kStore && settings_.sampling.samples_per_pixel > 1)
      refuse("/store" + pointer_step(velocity), "keeps the velocities of {} samples a pixel: a pixel has one",
             settings_.sampling.samples_per_pixel);
    if (settings_.post.taa == 0) return;
    actions.velocity_bytes = Taa::kVelocityBytes;
    actions.velocity_base = place_array(Taa::velocity_format(), region_);
  }

  void taa(FrameGraph& out) {
    if (!last_) refuse("", "runs before a pass has stored colours");
    if (!out.copies_.empty() || !glow_.empty())
      refuse("", "runs behind a {}: this machine antialiases the colours of the pass that draws",
             glow_.empty() ? "copy" : "bloom");
    if (pass().subpasses.size() > 1)
      refuse("/subpasses/1", "follows temporal antialiasing in its pass: it has a pass of its own");
    if (antialiased_) refuse("", "is a second temporal antialiasing: this machine runs one");
    const Subpass& one = pass().subpasses[0];
    const std::string below = subpass(0) + "/sample";
    if (last_->samples > 1)
      refuse(below, "is {}, which keeps {} samples a pixel: temporal antialiasing reads resolved colours",
             in_quotes(colors_), last_->samples);
    const std::string target = check_history();
    const auto drawing = std::ranges::find_if(graph_.passes, [&](const Pass& p) { return velocity_of(p) != nullptr; });
    if (drawing == graph_.passes.end())
      refuse(below, "has no velocities: an attachment with rg16f that the pass that draws writes");
    const std::string* const velocity = velocity_of(*drawing);
    const std::string depth(depth_attachment(graph_, *drawing));
    for (const std::string& name : one.sample)
      if (name != colors_ && name != *velocity && name != target && name != depth)
        refuse(below, "is {}: temporal antialiasing reads colours, velocities, depths and its history",
               in_quotes(name));
    if (std::ranges::find(one.sample, colors_) == one.sample.end())
      refuse(below, "is not {}, where the pass before left its colours", in_quotes(colors_));
    if (!pass().load.empty() || !pass().store.empty())
      refuse("", "overrides the loads and stores of temporal antialiasing");
    antialiased_ = true;
    colors_ = target;
    if (settings_.post.taa == 0) return;
    refuse_settings();
    Taa& made = out.taa_.emplace();
    made.name = pass().name, made.source = *last_, made.share = static_cast<float>(settings_.post.taa);
    if (std::ranges::find(one.sample, depth) != one.sample.end()) made.depth_bytes = out.actions_.depth_bytes;
    const tilecore::PixelCoder coder(tilecore::FrameFormat::kRgba16f, frame_exposure(capture_, settings_));
    last_ = tilecore::ColorAttachment{coder, 0, 1};
    made.before_base = place_array(Taa::history_format(), region_);
    last_->base = place_array(Taa::history_format(), region_);
    made.history = *last_;
  }

  // Returns the one attachment that temporal antialiasing writes and samples as the previous frame left it.
  std::string check_history() const {
    const Subpass& one = pass().subpasses[0];
    const std::string below = subpass(0) + "/write";
    const Attachment* target = one.write.size() == 1 ? graph_.find(one.write[0]) : nullptr;
    if (target == nullptr) refuse(below, "is not one attachment of its own");
    if (target->life != scene::AttachmentLife::kPersistent ||
        std::ranges::find(one.sample, target->name) == one.sample.end())
      refuse(below, "is {}, which is not the history that the pass samples", in_quotes(target->name));
    if (target->format != AttachmentFormat::kRgba16F)
      refuse(below, "is {} with {}: a history is rgba16f", in_quotes(target->name),
             scene::kAttachmentFormatNames[static_cast<std::size_t>(target->format)]);
    check_shape(below, *target);
    return target->name;
  }

  void refuse_settings() const {
    if (!whole_)
      throw UsageError(
          "a region of the frame: temporal antialiasing finds pixels anywhere in the previous frame; "
          "post.taa=0 leaves it out");
    if (gpu_.tile.rendering_elimination)
      throw UsageError(
          "temporal antialiasing takes its samples elsewhere in every frame, and no tile repeats: set "
          "tile.rendering_elimination=false, or post.taa=0");
    if (settings_.shading.path == tilecore::ShadingPath::kGbufferExternal)
      throw UsageError(
          "temporal antialiasing with shading.path=gbuffer_external: a G-buffer in memory keeps no velocities; "
          "set another path, or post.taa=0");
  }

  // Parameters of surfaces: lit in this pass, or stored for one that lights them.
  void fill(FrameGraph& out) {
    begin_drawing();
    if (prepass_) refuse("", "fills a G-buffer behind a pass of depths: this machine has one or the other");
    const std::vector<Subpass>& all = pass().subpasses;
    const std::string below = subpass(0) + "/write";
    const std::string* const velocity = velocity_of(pass());
    int bits = 0;
    for (const std::string& name : all[0].write) {
      if (velocity != nullptr && name == *velocity) continue;
      const Attachment* color = graph_.find(name);
      if (color == nullptr) refuse(below, "is {}, which is no attachment of its own", in_quotes(name));
      if (is_depth(color->format)) refuse(below, "is {}: a G-buffer keeps its depths in 'depth'", in_quotes(name));
      check_shape(below, *color);
      bits += sample_bits(color->format);
      parameters_.push_back(name);
    }
    for (const auto& [name, action] : pass().load)
      if (action == LoadAction::kLoad) refuse("/load" + pointer_step(name), "loads what gbuffer fills anew");
    if (bits < tilecore::ShadingSettings::kBitsWithoutEmission)
      refuse(below, "have {} bits a sample: material and normal of a lit surface take {}", bits,
             tilecore::ShadingSettings::kBitsWithoutEmission);
    const bool stored = all.size() == 1;  // a later pass lights them
    check_depth(LoadAction::kClear, stored ? StoreAction::kDiscard : depth_store(),
                "a G-buffer clears its depths, and moves them as its path does");
    out.name_ = pass().name;
    if (stored) {
      for (const auto& [name, action] : pass().store)
        if (action != StoreAction::kStore)
          refuse("/store" + pointer_step(name), "drops samples that a later pass lights");
      if (all[0].draw != DrawFilter::kAll)
        refuse(subpass(0) + "/draw", "leaves surfaces out: a pass that stores a G-buffer draws all of them");
      return;
    }
    for (const std::string& name : parameters_)
      if (action_of(pass().store, name).value_or(StoreAction::kDiscard) != StoreAction::kDiscard)
        refuse("/store" + pointer_step(name), "is stored, though this pass lights it");
    if (all[1].shader != PassShader::kLight) refuse_shader(1, "light follows gbuffer");
    read_parameters(1, all[1].input, "input");
    check_target(1, true);
    std::vector<DrawFilter> drawn{all[0].draw};
    for (std::size_t s = 2; s < all.size(); ++s) {
      if (maps_tones(s)) {
        map_on_chip(s);
        break;
      }
      if (all[s].shader != PassShader::kForward)
        refuse_shader(s, "behind light a pass runs forward, or tonemap at last");
      drawn.push_back(all[s].draw);
      check_target(s);
    }
    check_drawn(drawn);
    out.actions_ = target_actions();
    store_depth(out.actions_, std::string(scene::kDepthAttachment));
    if (velocity != nullptr) store_velocity(out.actions_, *velocity);
  }

  void light(FrameGraph& out) {
    if (parameters_.empty()) refuse("", "lights a G-buffer before a pass has stored one");
    if (pass().subpasses.size() > 2 || (pass().subpasses.size() == 2 && !maps_tones(1)))
      refuse("/subpasses/1", "follows light in a pass of its own: this machine runs a tone map there, or nothing");
    read_parameters(0, pass().subpasses[0].sample, "sample");
    check_target(0);
    if (pass().subpasses.size() == 2) map_on_chip(1);
    out.light_name_ = pass().name;
    out.actions_ = target_actions();
  }

  // Whether a subpass is a tone map at the end of its pass.
  bool maps_tones(std::size_t number) const {
    return number > 0 && number + 1 == pass().subpasses.size() &&
           pass().subpasses[number].shader == PassShader::kTonemap;
  }

  void check_drawn(const std::vector<DrawFilter>& drawn) const {
    if (drawn != std::vector{DrawFilter::kAll} && drawn != std::vector{DrawFilter::kOpaque, DrawFilter::kBlended})
      refuse(subpass(0) + "/draw", "leaves surfaces out: draw all, or opaque and then blended ones");
  }

  // The store of the pass's depth that its capture asks for.
  StoreAction depth_store() const {
    return action_of(pass().store, depth_attachment(graph_, pass())).value_or(StoreAction::kDiscard);
  }

  // Refuses loads and stores of the pass's depth that ask for more than these.
  void check_depth(LoadAction load, StoreAction store, std::string_view rule) const {
    const std::string depth(depth_attachment(graph_, pass()));
    if (depth != scene::kDepthAttachment) refuse("", "keeps its depths in {}, not in 'depth'", in_quotes(depth));
    if (action_of(pass().load, depth).value_or(load) != load)
      refuse("/load" + pointer_step(depth), "is another one: {}", rule);
    if (action_of(pass().store, depth).value_or(store) != store)
      refuse("/store" + pointer_step(depth), "is another one: {}", rule);
  }

  // The light half reads all that the fill half has left, and the depth.
  void read_parameters(std::size_t number, std::vector<std::string> read, std::string_view how) {
    std::vector<std::string> left = std::exchange(parameters_, {});
    left.emplace_back(scene::kDepthAttachment);
    std::ranges::sort(left), std::ranges::sort(read);
    if (left != read)
      refuse(fmt::format("{}/{}", subpass(number), how), "is not the G-buffer and 'depth': light reads all of it");
  }

  // The store of the frame applies the tone map. Colours of earlier subpasses do not leave the chip.
  void map_on_chip(std::size_t number) {
    const Subpass& one = pass().subpasses[number];
    const std::string below = subpass(number);
    if (one.input != std::vector{colors_} || !one.sample.empty())
      refuse(below + "/input", "is not {} alone, as before in this pass", in_quotes(colors_));
    if (one.write != std::vector<std::string>{std::string(scene::kFrameAttachment)})
      refuse(below + "/write", "is not the frame, into which a tone map on chip goes");
    for (std::size_t other = 0; other < graph_.passes.size(); ++other)
      for (const Subpass& reader : graph_.passes[other].subpasses)
        if (std::ranges::find(reader.sample, colors_) != reader.sample.end())
          refuse(below + "/input", "is {}, which pass {} samples: map it in a pass of its own", in_quotes(colors_),
                 other);
    if (action_of(pass().store, colors_).value_or(StoreAction::kDiscard) != StoreAction::kDiscard ||
        action_of(pass().load, colors_).value_or(LoadAction::kClear) == LoadAction::kLoad)
      refuse("/store" + pointer_step(colors_), "is moved, though a tone map on chip reads it alone");
    colors_ = scene::kFrameAttachment;
  }

  void bloom(FrameGraph& out) {
    if (!last_) refuse("", "runs before a pass has stored colours");
    if (!out.copies_.empty()) refuse("", "runs behind a copy: this machine blooms the colours of the pass that draws");
    const Subpass& one = pass().subpasses[0];
    if (pass().subpasses.size() > 1) refuse("/subpasses/1", "follows a bloom in its pass: it has passes of its own");
    if (one.sample.size() != 1 || one.sample[0] != colors_)
      refuse(subpass(0) + "/sample", "is not {}, where the pass before left its colours", in_quotes(colors_));
    if (!glow_.empty()) refuse("", "is a second bloom: this machine runs one");
    if (last_->samples > 1)
      refuse(subpass(0) + "/sample", "is {}, which keeps {} samples a pixel: a bloom reads resolved colours",
             in_quotes(colors_), last_->samples);
    const std::string below = subpass(0) + "/write";
    const Attachment* target = one.write.size() == 1 ? graph_.find(one.write[0]) : nullptr;
    if (target == nullptr) refuse(below, "is not one attachment of its own");
    if (target->format != AttachmentFormat::kRgba16F && target->format != AttachmentFormat::kR11G11B10F)
      refuse(below, "is {} with {}: a bloom fills rgba16f or r11g11b10f", in_quotes(target->name),
             scene::kAttachmentFormatNames[static_cast<std::size_t>(target->format)]);
    if (target->size || target->scale > 1 || target->samples > 1 || target->layers != 1)
      refuse(below, "is {}, which has a size, samples, layers or more pixels than the frame", in_quotes(target->name));
    if (!pass().load.empty() || !pass().store.empty()) refuse("", "overrides the loads and stores of a bloom");
    glow_ = target->name;
    if (settings_.post.bloom == 0) return;
    if (!whole_) throw UsageError("a region of the frame: any of its pixels may get light by the bloom of the capture");
    if (gpu_.tile.rendering_elimination)
      throw UsageError("a bloom needs all pixels of a frame: set tile.rendering_elimination=false, or post.bloom=0");
    const int levels = settings_.post.bloom_levels > 0 ? settings_.post.bloom_levels : target->levels;
    out.bloom_.emplace(pass().name, *last_, target->format, target->scale, levels, frame_[0], frame_[1]);
    for (std::size_t level = 0; level < out.bloom_->levels(); ++level) {
      const auto [width, height] = out.bloom_->size(level);
      out.bloom_->place_level(place_array(out.bloom_->texel_format(), {0, 0, width, height}));
    }
  }

  void store_depth(tilecore::AttachmentActions& actions, const std::string& depth) {
    const Subpass* const reader = antialiasing();
    const bool sampled =
        reader != nullptr && settings_.post.taa > 0 && std::ranges::find(reader->sample, depth) != reader->sample.end();
    const StoreAction store =
        action_of(pass().store, depth).value_or(sampled ? StoreAction::kResolve : StoreAction::kDiscard);
    if (store == StoreAction::kDiscard) return;
    if (sampled && store == StoreAction::kStore && settings_.sampling.samples_per_pixel > 1)
      refuse("/store" + pointer_step(depth), "keeps the depths of {} samples a pixel: temporal antialiasing reads one",
             settings_.sampling.samples_per_pixel);
    const Attachment* declared = graph_.find(depth);
    if (declared != nullptr) check_shape("", *declared);
    const int bits = declared == nullptr ? 32 : sample_bits(declared->format);
    const int samples = store == StoreAction::kResolve ? 1 : settings_.sampling.samples_per_pixel;
    actions.depth_bytes = static_cast<std::uint64_t>(bits / 8 * samples);
    actions.depth_samples = samples;
    actions.depth_base = place_array(tilecore::depth_format(static_cast<std::uint64_t>(bits / 8), samples), region_);
  }

  void copy(FrameGraph& out) {
    if (colors_.empty()) refuse("", "runs before a pass has left colours");
    const Subpass& one = pass().subpasses[0];
    if (pass().subpasses.size() > 1)
      refuse("/subpasses/1", "runs over an image that was copied: copies have a pass each");
    const bool maps = one.shader == PassShader::kTonemap;
    if (one.shader != PassShader::kCopy && !maps)
      refuse_shader(0, "a pass over an image runs taa, bloom, tonemap or copy");
    const bool adds = maps && one.sample.size() == 2 && !glow_.empty() && one.sample[1] == glow_;
    if (one.sample.empty() || one.sample[0] != colors_ || (one.sample.size() != 1 && !adds))
      refuse(subpass(0) + "/sample", "is not {}, where the pass before left its colours{}", in_quotes(colors_),
             maps ? ", and a bloom" : "");
    const tilecore::ColorAttachment source = *last_;
    check_target(0);
    if (maps && colors_ != scene::kFrameAttachment)
      refuse(subpass(0) + "/write", "is not the frame: a tone map is last");
    out.copies_.push_back({pass().name, source, target_actions(), adds && out.bloom_.has_value()});
  }

  // Sets colors_ to the one colour that a subpass writes; all subpasses of its pass from the `first` one on write the same.
  void check_target(std::size_t number, bool first = false) {
    const std::string below = subpass(number) + "/write";
    std::string color;
    const std::string* const velocity = velocity_of(pass());
    for (const std::string& name : pass().subpasses[number].write) {
      const Attachment* declared = graph_.find(name);
      if (name == scene::kDepthAttachment || (declared != nullptr && is_depth(declared->format))) continue;
      if (velocity != nullptr && name == *velocity && pass().subpasses[number].write.size() > 1) continue;
      if (!color.empty()) refuse(below, "are several colours: this machine renders one");
      color = name;
    }
    if (number > 0 && !first && color != colors_)
      refuse(below, "is not {}, as before in this pass", in_quotes(colors_));
    if (color == scene::kFrameAttachment && pass_ != last_pass())
      refuse(below, "is 'frame' before the last pass: passes read an attachment of their own");
    if (const Attachment* declared = graph_.find(color)) {
      check_shape(below, *declared);
      if (!color_format(declared->format))
        refuse(below, "is {} with {}: this machine stores colours as rgba8, rgb10a2 or rgba16f", in_quotes(color),
               scene::kAttachmentFormatNames[static_cast<std::size_t>(declared->format)]);
    }
    colors_ = color;
  }

  std::size_t last_pass() const { return static_cast<std::size_t>(pass_order(graph_).back()); }

  void check_shape(const std::string& below, const Attachment& a) const {
    if (a.size || a.scale != 1) refuse(below, "is {}, which has another size than the frame", in_quotes(a.name));
    if (a.samples > 1 && a.samples != settings_.sampling.samples_per_pixel)
      refuse(below, "is {} with {} samples: the frame has {}", in_quotes(a.name), a.samples,
             settings_.sampling.samples_per_pixel);
    if (a.layers != 1 || a.levels != 1) refuse(below, "is {}, which has layers or levels", in_quotes(a.name));
  }

  // Returns the load and store of colors_, the colours that the pass writes.
  tilecore::AttachmentActions target_actions() {
    tilecore::AttachmentActions actions;
    actions.load_color = action_of(pass().load, colors_) == LoadAction::kLoad;
    const Attachment* declared = graph_.find(colors_);
    if (declared == nullptr) return actions;
    const bool several = declared->samples != 1 && (draws(pass()) || shades_in_parts(pass())) &&
                         action_of(pass().store, colors_) == StoreAction::kStore;
    if (settings_.resolve.desampling != tilecore::Desampling::kOff)
      throw UsageError(
          fmt::format("pass {} stores its colours in {}: set resolve.desampling=off, which works on the frame",
                      in_quotes(pass().name), in_quotes(colors_)));
    const tilecore::PixelCoder coder(*color_format(declared->format), frame_exposure(capture_, settings_));
    last_ = tilecore::ColorAttachment{coder, 0, several ? settings_.sampling.samples_per_pixel : 1};
    last_->number = attachment_count_++;
    const tilecore::FrameStore store = attachment_store(gpu_, *last_);
    last_->base =
        store.compressed ? place_bytes(tilecore::TileStore::frame_bytes(store, region_)) : place(last_->pixel_bytes());
    actions.color = last_;
    return actions;
  }

  // Returns the base of an attachment with so many bytes a pixel, behind the earlier ones.
  std::uint64_t place(std::uint64_t pixel_bytes) { return place_bytes(pixels_ * pixel_bytes); }
  std::uint64_t place_array(const tilecore::TexelFormat& format, IntRect texels) {
    return place_bytes(array_bytes(gpu_, format, texels));
  }
  std::uint64_t place_bytes(std::uint64_t bytes) {
    const auto burst = static_cast<std::uint64_t>(gpu_.memory.burst_bytes);
    return std::exchange(end_, end_ + round_up(bytes, burst));
  }

  [[noreturn]] void refuse_shader(std::size_t number, std::string_view rule) const {
    const auto shader = static_cast<std::size_t>(pass().subpasses[number].shader);
    refuse(subpass(number) + "/shader", "is {}: {} on this machine", scene::kPassShaderNames[shader], rule);
  }

  const scene::Capture& capture_;
  const scene::PassGraph& graph_;
  const GpuConfiguration& gpu_;
  const RunSettings& settings_;
  std::array<int, 2> frame_;
  IntRect region_;
  bool whole_;        // all of the frame is rendered
  std::string glow_;  // attachment that a bloom fills; empty: none has run
  bool antialiased_ = false;
  std::uint64_t pixels_, end_ = 0;
  int attachment_count_ = 0;  // attachments of colours so far
  std::size_t pass_ = 0;
  bool prepass_ = false;                           // a pass of depths has run
  std::vector<std::string> parameters_;            // attachments of a G-buffer that is not lit yet
  std::string colors_;                             // attachment of the last pass that drew; empty: none has drawn
  std::optional<tilecore::ColorAttachment> last_;  // nullopt: the last pass wrote the frame
};

std::vector<tilecore::ColorAttachment> FrameGraph::attachments() const {
  std::vector<tilecore::ColorAttachment> all;
  if (actions_.color) all.push_back(*actions_.color);
  for (const CopyPass& copy : copies_)
    if (copy.actions.color) all.push_back(*copy.actions.color);
  return all;
}

bool FrameGraph::loads_frame() const {
  const auto loads = [](const tilecore::AttachmentActions& actions) { return actions.load_color && !actions.color; };
  return loads(actions_) || std::ranges::any_of(copies_, [&](const CopyPass& copy) { return loads(copy.actions); });
}

FrameGraph::FrameGraph(const scene::Capture& capture, const GpuConfiguration& gpu, const RunSettings& settings,
                       IntRect region, const std::array<int, 2>& frame) {
  if (capture.settings.graph) Reader(capture, gpu, settings, region, frame).read(*this);
}

}  // namespace tessera::gpu
