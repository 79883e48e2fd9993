#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/round_up.h"
#include "scene/capture.h"
#include "scene/pass_graph.h"

// Graphs of passes as captures describe them, and their parts.
namespace tessera::test {

inline scene::Attachment attachment(std::string name, scene::AttachmentFormat format, double scale = 1,
                                    int levels = 1) {
  scene::Attachment made;
  made.name = std::move(name), made.format = format;
  made.scale = scale, made.levels = levels;
  return made;
}

// A pass of one subpass that runs a shader over what other passes have stored.
inline scene::Pass over_image(std::string name, scene::PassShader shader, std::vector<std::string> sources,
                              std::string target) {
  scene::Pass pass;
  pass.name = std::move(name);
  pass.subpasses = {{scene::DrawFilter::kNothing, shader, {}, {std::move(target)}, std::move(sources)}};
  return pass;
}
inline scene::Pass copying(std::string name, std::string source, std::string target) {
  return over_image(std::move(name), scene::PassShader::kCopy, {std::move(source)}, std::move(target));
}
// The pass `draw`, which shades surfaces.
inline scene::Pass drawing(std::string target, scene::DrawFilter draw = scene::DrawFilter::kAll) {
  scene::Pass pass;
  pass.name = "draw";
  pass.subpasses = {{draw, scene::PassShader::kForward, {}, {std::move(target)}, {}}};
  return pass;
}

// The surfaces go to `lit` and from there into the frame.
inline scene::PassGraph by_way_of(scene::AttachmentFormat format) {
  return {{attachment("lit", format)}, {drawing("lit"), copying("final", "lit", "frame")}};
}

// Temporal antialiasing between the surfaces and the frame. `depths`: it samples depths.
inline scene::PassGraph antialiasing(bool depths = true) {
  using enum scene::AttachmentFormat;
  scene::PassGraph graph{
      {attachment("lit", kRgba16F), attachment("velocity", kRg16F), attachment("history", kRgba16F)},
      {drawing("lit"), over_image("taa", scene::PassShader::kTaa, {"lit", "velocity", "history"}, "history"),
       copying("final", "history", "frame")}};
  graph.attachments[2].life = scene::AttachmentLife::kPersistent;
  graph.passes[0].subpasses[0].write.push_back("velocity");
  if (depths) graph.passes[1].subpasses[0].sample.push_back("depth");
  return graph;
}

inline scene::Pass pass_of(const char* name, std::vector<scene::Subpass> subpasses) {
  scene::Pass pass;
  pass.name = name, pass.lists_subpasses = subpasses.size() > 1, pass.subpasses = std::move(subpasses);
  return pass;
}

// The graph of a shading path: `prepass`, or `gbuffer` or `gbuffer_external` with a G-buffer of 192 bits.
inline scene::PassGraph shading_graph(const std::string& path) {
  using enum scene::PassShader;
  using enum scene::DrawFilter;
  scene::PassGraph graph;
  const std::vector<std::string> colors = {"albedo", "normal", "glow"}, all = {"albedo", "normal", "glow", "depth"};
  for (const std::string& name : colors) {
    scene::Attachment& color = graph.attachments.emplace_back();
    color.name = name, color.format = scene::AttachmentFormat::kRgba16F;
  }
  if (path == "prepass") {
    scene::Pass draw = pass_of("draw", {{kAll, kForward, {}, {"frame"}, {}}});
    draw.load = {{"depth", scene::LoadAction::kLoad}};
    graph.passes = {pass_of("depths", {{kOpaque, kDepth, {}, {}, {}}}), draw};
  } else if (path == "gbuffer") {
    graph.passes = {pass_of("draw", {{kOpaque, kGbuffer, {}, colors, {}},
                                     {kNothing, kLight, all, {"frame"}, {}},
                                     {kBlended, kForward, {}, {"frame"}, {}}})};
  } else {
    graph.passes = {pass_of("draw", {{kAll, kGbuffer, {}, colors, {}}}),
                    pass_of("lit", {{kNothing, kLight, {}, {"frame"}, all}})};
  }
  return graph;
}

// The capture with this graph instead of its own. Throws std::logic_error for a graph with a fault.
inline scene::Capture with_graph(scene::Capture capture, std::optional<scene::PassGraph> graph) {
  if (graph)
    if (const std::optional<scene::GraphFault> fault = find_fault(*graph))
      throw std::logic_error(fault->pointer + " " + fault->text);
  capture.settings.graph = std::move(graph);
  return capture;
}

// So many bytes in whole bursts of 64.
inline std::uint64_t bursts(std::uint64_t bytes) { return round_up(bytes, std::uint64_t{64}); }

}  // namespace tessera::test
