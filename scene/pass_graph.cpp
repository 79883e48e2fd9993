#include "scene/pass_graph.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/json_text.h"
#include "base/text.h"

namespace tessera::scene {
namespace {

using Fault = std::optional<GraphFault>;

// An attachment like `frame` and `depth`, as far as they do not depend on the machine.
Attachment existing(std::string_view name, AttachmentFormat format) {
  Attachment attachment;
  attachment.name = name;
  attachment.format = format;
  return attachment;
}
const Attachment kFrameShape = existing(kFrameAttachment, AttachmentFormat::kRgba8);
const Attachment kDepthShape = existing(kDepthAttachment, AttachmentFormat::kD32F);

// nullptr for names that the graph does not have.
const Attachment* known(const PassGraph& graph, std::string_view name) {
  return name == kFrameAttachment ? &kFrameShape : name == kDepthAttachment ? &kDepthShape : graph.find(name);
}

bool draws(const Pass& pass) {
  return std::any_of(pass.subpasses.begin(), pass.subpasses.end(),
                     [](const Subpass& s) { return s.draw != DrawFilter::kNothing; });
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string in_quotes(std::string_view name) { return "'" + escape_control(name, 60) + "'"; }

// Names that the subpasses of a pass write, in their order, without the depth that drawing implies.
std::vector<std::string> listed_writes(const Pass& pass) {
  std::vector<std::string> names;
  for (const Subpass& subpass : pass.subpasses)
    for (const std::string& name : subpass.write)
      if (!contains(names, name)) names.push_back(name);
  return names;
}

// The same with that depth.
std::vector<std::string> all_writes(const PassGraph& graph, const Pass& pass) {
  std::vector<std::string> names = listed_writes(pass);
  if (const std::string depth(depth_attachment(graph, pass)); !depth.empty() && !contains(names, depth))
    names.push_back(depth);
  return names;
}

// Writers and samplers of an attachment, as indices of passes in the order of the list.
//   writer_of()  The pass whose contents a sampling pass finds: the last writer before it, else the first one after it;
//                -1 for the contents of the previous frame, and where no pass writes the attachment.
class Uses {
 public:
  explicit Uses(const PassGraph& graph) : graph_(graph) {
    for (std::size_t p = 0; p < graph.passes.size(); ++p)
      for (const std::string& name : all_writes(graph, graph.passes[p])) writers_[name].push_back(static_cast<int>(p));
  }

  const std::vector<int>& writers(const std::string& name) const {
    static const std::vector<int> kNoWriter;
    const auto found = writers_.find(name);
    return found == writers_.end() ? kNoWriter : found->second;
  }
  int writer_of(const std::string& name, int sampling) const {
    const std::vector<int>& all = writers(name);
    const auto behind = std::lower_bound(all.begin(), all.end(), sampling);
    if (behind != all.begin()) return *std::prev(behind);
    const Attachment* attachment = known(graph_, name);
    const bool persistent = attachment != nullptr && attachment->life == AttachmentLife::kPersistent;
    return all.empty() || persistent ? -1 : all.front();
  }
  // The pass that overwrites the result of `writer` (-1: the previous frame); -1 where none does.
  int next_writer(const std::string& name, int writer) const {
    const std::vector<int>& all = writers(name);
    const auto next = std::upper_bound(all.begin(), all.end(), writer);
    return next == all.end() ? -1 : *next;
  }

 private:
  const PassGraph& graph_;
  std::map<std::string, std::vector<int>> writers_;
};

// The passes that each pass waits for.
std::vector<std::set<int>> waits(const PassGraph& graph) {
  const Uses uses(graph);
  std::vector<std::set<int>> out(graph.passes.size());
  const auto wait = [&](int pass, int before) {
    if (pass >= 0 && before >= 0 && pass != before) out[static_cast<std::size_t>(pass)].insert(before);
  };
  for (std::size_t p = 0; p < graph.passes.size(); ++p) {
    const int pass = static_cast<int>(p);
    for (const std::string& name : all_writes(graph, graph.passes[p])) wait(uses.next_writer(name, pass), pass);
    for (const Subpass& subpass : graph.passes[p].subpasses)
      for (const std::string& name : subpass.sample) {
        const int writer = uses.writer_of(name, pass);
        wait(pass, writer);
        wait(uses.next_writer(name, writer), pass);
      }
  }
  return out;
}

// Looks for the first fault, one law after the other.
class Check {
 public:
  explicit Check(const PassGraph& graph) : graph_(graph) {}

  Fault run() const {
    if (Fault fault = attachments()) return fault;
    for (const auto law :
         {&Check::names, &Check::shaders, &Check::shapes, &Check::inputs, &Check::samples, &Check::stores})
      for (std::size_t p = 0; p < graph_.passes.size(); ++p)
        if (Fault fault = (this->*law)(p)) return fault;
    return order();
  }

 private:
  template <class... Args>
  static Fault fault(std::string pointer, fmt::format_string<Args...> text, Args&&... args) {
    return GraphFault{std::move(pointer), fmt::format(text, std::forward<Args>(args)...)};
  }
  static std::string at(std::size_t pass) { return fmt::format("/passes/{}", pass); }
  std::string at(std::size_t pass, std::size_t subpass) const {
    return at(pass) + (graph_.passes[pass].lists_subpasses ? fmt::format("/subpasses/{}", subpass) : "");
  }
  std::string at(std::size_t pass, std::size_t subpass, std::string_view list, std::size_t index) const {
    return fmt::format("{}/{}/{}", at(pass, subpass), list, index);
  }

  // Calls look(pointer, name) for each element of a list of names of a pass's subpasses, until it returns a fault.
  template <class Look>
  Fault each(std::size_t pass, std::string_view list, std::vector<std::string> Subpass::*names,
             const Look& look) const {
    const std::vector<Subpass>& subpasses = graph_.passes[pass].subpasses;
    for (std::size_t s = 0; s < subpasses.size(); ++s)
      for (std::size_t i = 0; i < (subpasses[s].*names).size(); ++i)
        if (Fault found = look(at(pass, s, list, i), (subpasses[s].*names)[i])) return found;
    return std::nullopt;
  }

  // ---- RG1 ------------------------------------------------------------------------------------------------------

  Fault attachments() const {
    std::set<std::string_view> seen;
    for (const Attachment& a : graph_.attachments) {
      const std::string place = "/attachments" + pointer_step(a.name);
      if (a.name == kFrameAttachment || a.name == kDepthAttachment)
        return fault(place, "exists in every graph: choose another name");
      if (!seen.insert(a.name).second) return fault(place, "is there twice");
      if (!a.size) continue;
      const auto largest = static_cast<unsigned>(std::max((*a.size)[0], (*a.size)[1]));
      if (const int most = std::bit_width(largest); a.levels > most)
        return fault(place + "/levels", "are {}, {}x{} pixels have {}", a.levels, (*a.size)[0], (*a.size)[1], most);
    }
    return std::nullopt;
  }

  Fault names(std::size_t p) const {
    const Pass& pass = graph_.passes[p];
    for (std::size_t before = 0; before < p; ++before)
      if (graph_.passes[before].name == pass.name)
        return fault(at(p) + "/name", "is {}, as passes/{} is called", in_quotes(pass.name), before);
    const auto unknown = [&](const std::string& place, const std::string& name) -> Fault {
      if (known(graph_, name) != nullptr) return std::nullopt;
      return fault(place, "is {}, which is no attachment", in_quotes(name));
    };
    for (const auto& [list, member] :
         {std::pair{"input", &Subpass::input}, {"write", &Subpass::write}, {"sample", &Subpass::sample}})
      if (Fault found = each(p, list, member, unknown)) return found;
    const std::vector<std::string> written = all_writes(graph_, pass);
    const auto not_written = [&](std::string_view list, const std::string& name) -> Fault {
      const std::string place = fmt::format("{}/{}{}", at(p), list, pointer_step(name));
      if (known(graph_, name) == nullptr) return fault(place, "is no attachment");
      if (!contains(written, name)) return fault(place, "is an attachment that the pass does not write");
      return std::nullopt;
    };
    for (const auto& [name, action] : pass.load)
      if (Fault found = not_written("load", name)) return found;
    for (const auto& [name, action] : pass.store)
      if (Fault found = not_written("store", name)) return found;
    return std::nullopt;
  }

  // ---- RG2: attachments of a pass fit each other ------------------------------------------------------------------

  static std::string size_text(const Attachment& a) {
    if (a.size) return fmt::format("{}x{} pixels", (*a.size)[0], (*a.size)[1]);
    return a.scale == 1 ? "the size of the frame" : fmt::format("{:g} times the size of the frame", a.scale);
  }
  static std::string samples_text(const Attachment& a) {
    return a.samples == 0 ? "the samples of the frame"
                          : fmt::format("{} sample{}", a.samples, a.samples == 1 ? "" : "s");
  }

  // Says why two attachments do not fit into one pass; empty where they do.
  static std::string misfit(const Attachment& a, const Attachment& b) {
    const bool same_size = a.size ? a.size == b.size : !b.size && a.scale == b.scale;
    if (!same_size) return fmt::format("has {}, {} has {}", size_text(a), in_quotes(b.name), size_text(b));
    if (a.layers != b.layers) return fmt::format("has {} layers, {} has {}", a.layers, in_quotes(b.name), b.layers);
    if (a.samples != b.samples)
      return fmt::format("has {}, {} has {}", samples_text(a), in_quotes(b.name), samples_text(b));
    return "";
  }

  Fault shapes(std::size_t p) const {
    const Pass& pass = graph_.passes[p];
    const std::vector<std::string> written = listed_writes(pass);
    if (written.empty()) return std::nullopt;
    const Attachment& first = *known(graph_, written.front());
    std::size_t colors = 0;
    const Attachment* depth = nullptr;
    std::set<std::string_view> seen;
    const auto fits = [&](const std::string& place, const std::string& name) -> Fault {
      if (!seen.insert(name).second) return std::nullopt;
      const Attachment& a = *known(graph_, name);
      if (const std::string wrong = misfit(a, first); !wrong.empty())
        return fault(place, "{}: a pass writes attachments of one shape", wrong);
      if (!is_depth(a.format) && ++colors > Pass::kMaxColors)
        return fault(place, "is one colour too many, a pass writes {} at most", Pass::kMaxColors);
      if (!is_depth(a.format)) return std::nullopt;
      if (depth != nullptr) return fault(place, "is a second depth beside {}, a pass has one", in_quotes(depth->name));
      depth = &a;
      return std::nullopt;
    };
    if (Fault found = each(p, "write", &Subpass::write, fits)) return found;
    const auto input_fits = [&](const std::string& place, const std::string& name) -> Fault {
      const std::string wrong = misfit(*known(graph_, name), first);
      if (wrong.empty()) return std::nullopt;
      return fault(place, "{}: an input is read at its own pixel, sample it instead", wrong);
    };
    if (Fault found = each(p, "input", &Subpass::input, input_fits)) return found;
    if (const std::string wrong = misfit(first, kDepthShape); draws(pass) && depth == nullptr && !wrong.empty())
      return each(p, "write", &Subpass::write, [&](const std::string& place, const std::string&) {
        return fault(place, "{}, which a pass that draws writes: let it write an attachment of a depth format", wrong);
      });
    return std::nullopt;
  }

  // ---- RG3 --------------------------------------------------------------------------------------------------------

  Fault inputs(std::size_t p) const {
    const Pass& pass = graph_.passes[p];
    const std::string depth(depth_attachment(graph_, pass));
    std::set<std::string> written;
    for (std::size_t s = 0; s < pass.subpasses.size(); ++s) {
      const Subpass& subpass = pass.subpasses[s];
      for (std::size_t i = 0; i < subpass.input.size(); ++i)
        if (!written.contains(subpass.input[i]))
          return fault(at(p, s, "input", i), "is {}, which no earlier subpass of {} writes",
                       in_quotes(subpass.input[i]), in_quotes(pass.name));
      written.insert(subpass.write.begin(), subpass.write.end());
      if (subpass.draw != DrawFilter::kNothing) written.insert(depth);
    }
    return std::nullopt;
  }

  // ---- RG4, RG5 -----------------------------------------------------------------------------------------------------

  Fault samples(std::size_t p) const {
    const Pass& pass = graph_.passes[p];
    const std::vector<std::string> written = all_writes(graph_, pass);
    return each(p, "sample", &Subpass::sample, [&](const std::string& place, const std::string& name) -> Fault {
      const AttachmentLife life = known(graph_, name)->life;
      if (life == AttachmentLife::kTransient)
        return fault(place, "is {}, which is transient: it exists in tile memory alone", in_quotes(name));
      const bool earlier_frame = life == AttachmentLife::kPersistent && uses_.writer_of(name, static_cast<int>(p)) < 0;
      if (!earlier_frame && contains(written, name))
        return fault(place, "is {}, which {} writes itself", in_quotes(name), in_quotes(pass.name));
      if (uses_.writers(name).empty()) return fault(place, "is {}, which no pass writes", in_quotes(name));
      return std::nullopt;
    });
  }

  Fault stores(std::size_t p) const {
    const Pass& pass = graph_.passes[p];
    const auto transient = [&](const std::string& name) {
      return known(graph_, name)->life == AttachmentLife::kTransient;
    };
    for (const auto& [name, action] : pass.load)
      if (action == LoadAction::kLoad && transient(name))
        return fault(at(p) + "/load" + pointer_step(name), "is transient: there is nothing to load");
    for (const auto& [name, action] : pass.store) {
      const std::string place = at(p) + "/store" + pointer_step(name);
      if (action != StoreAction::kDiscard && transient(name)) return fault(place, "is transient: it is not stored");
      if (action != StoreAction::kDiscard) continue;
      if (name == kFrameAttachment && uses_.writers(name).back() == static_cast<int>(p))
        return fault(place, "is discarded by the last pass that writes it");
      for (std::size_t other = 0; other < graph_.passes.size(); ++other)
        for (const Subpass& subpass : graph_.passes[other].subpasses)
          if (contains(subpass.sample, name) && uses_.writer_of(name, static_cast<int>(other)) == static_cast<int>(p))
            return fault(place, "is discarded, and {} samples it", in_quotes(graph_.passes[other].name));
    }
    return std::nullopt;
  }

  // ---- RG7 --------------------------------------------------------------------------------------------------------

  Fault shaders(std::size_t p) const {
    const Pass& pass = graph_.passes[p];
    if (pass.view == PassView::kRight && !draws(pass)) return fault(at(p) + "/view", "needs a subpass that draws");
    for (std::size_t s = 0; s < pass.subpasses.size(); ++s)
      if (Fault found = shader(p, s, pass.subpasses[s])) return found;
    return std::nullopt;
  }

  Fault shader(std::size_t p, std::size_t s, const Subpass& subpass) const {
    using enum PassShader;
    const std::string place = at(p, s) + "/shader";
    const std::string_view name = kPassShaderNames[static_cast<std::size_t>(subpass.shader)];
    if (is_drawing(subpass.shader) && subpass.draw == DrawFilter::kNothing)
      return fault(place, "is {}, which needs the property 'draw'", name);
    if (!is_drawing(subpass.shader) && subpass.draw != DrawFilter::kNothing)
      return fault(at(p, s) + "/draw", "does not fit the shader {}, which runs over an image", name);
    const auto is_color = [&](const std::string& a) { return !is_depth(known(graph_, a)->format); };
    const std::size_t colors =
        static_cast<std::size_t>(std::count_if(subpass.write.begin(), subpass.write.end(), is_color));
    if (subpass.shader == kDepth && colors > 0) return fault(place, "is depth, which writes no colours");
    if ((subpass.shader == kForward || subpass.shader == kGbuffer) && colors == 0)
      return fault(place, "is {}, which needs a colour to write", name);
    if (is_drawing(subpass.shader)) return std::nullopt;
    if (subpass.write.empty()) return fault(place, "is {}, which needs an attachment to write", name);
    const bool beyond_pixel = subpass.shader == kReduce || subpass.shader == kBloom || subpass.shader == kTaa;
    if (beyond_pixel && subpass.sample.empty()) return fault(place, "is {}, which needs an attachment to sample", name);
    if (subpass.sample.empty() && subpass.input.empty())
      return fault(place, "is {}, which needs an input or an attachment to sample", name);
    const auto is_persistent = [&](const std::string& a) {
      return known(graph_, a)->life == AttachmentLife::kPersistent;
    };
    if (subpass.shader == kTaa && std::none_of(subpass.sample.begin(), subpass.sample.end(), is_persistent))
      return fault(place, "is taa, which needs a persistent attachment to sample: its history");
    return std::nullopt;
  }

  // ---- RG5, RG6 -----------------------------------------------------------------------------------------------------

  // A wait for a pass behind in the list closes a cycle; only a sample can be one.
  Fault order() const {
    if (uses_.writers(std::string(kFrameAttachment)).empty()) return fault("/passes", "none writes 'frame'");
    if (!pass_order(graph_).empty()) return std::nullopt;
    const std::vector<std::set<int>> before = waits(graph_);
    for (std::size_t p = 0; p < graph_.passes.size(); ++p) {
      const Fault found =
          each(p, "sample", &Subpass::sample, [&](const std::string& place, const std::string& name) -> Fault {
            const int writer = uses_.writer_of(name, static_cast<int>(p));
            if (writer <= static_cast<int>(p)) return std::nullopt;
            const std::vector<std::string> way = way_between(before, writer, static_cast<int>(p));
            if (way.empty()) return std::nullopt;
            return fault(place, "closes a cycle: {} waits for {}", in_quotes(graph_.passes[p].name),
                         fmt::join(way, ", which waits for "));
          });
      if (found) return found;
    }
    return fault("/passes", "wait for each other");
  }

  // Names of the passes on the shortest way of waits from one pass to another, both included; empty where there is none.
  std::vector<std::string> way_between(const std::vector<std::set<int>>& before, int from, int to) const {
    std::map<int, int> reached_from = {{from, -1}};
    std::vector<int> waiting = {from};
    for (std::size_t next = 0; next < waiting.size() && !reached_from.contains(to); ++next)
      for (const int further : before[static_cast<std::size_t>(waiting[next])])
        if (reached_from.try_emplace(further, waiting[next]).second) waiting.push_back(further);
    std::vector<std::string> names;
    if (!reached_from.contains(to)) return names;
    for (int pass = to; pass >= 0; pass = reached_from[pass])
      names.push_back(in_quotes(graph_.passes[static_cast<std::size_t>(pass)].name));
    std::reverse(names.begin(), names.end());
    return names;
  }

  const PassGraph& graph_;
  const Uses uses_{graph_};
};

}  // namespace

const Attachment* PassGraph::find(std::string_view name) const {
  const auto found =
      std::find_if(attachments.begin(), attachments.end(), [&](const Attachment& a) { return a.name == name; });
  return found == attachments.end() ? nullptr : &*found;
}

bool is_velocity(const PassGraph& graph, std::string_view name) {
  const Attachment* const declared = graph.find(name);
  if (declared == nullptr || declared->format != AttachmentFormat::kRg16F) return false;
  const auto samples = [&](const Subpass& subpass) {
    return subpass.shader == PassShader::kTaa && std::ranges::find(subpass.sample, name) != subpass.sample.end();
  };
  return std::ranges::any_of(graph.passes,
                             [&](const Pass& pass) { return std::ranges::any_of(pass.subpasses, samples); });
}

std::string_view depth_attachment(const PassGraph& graph, const Pass& pass) {
  for (const Subpass& subpass : pass.subpasses)
    for (const std::string& name : subpass.write)
      if (const Attachment* a = known(graph, name); a != nullptr && is_depth(a->format)) return a->name;
  return draws(pass) ? kDepthAttachment : std::string_view();
}

std::optional<GraphFault> find_fault(const PassGraph& graph) { return Check(graph).run(); }

std::vector<int> pass_order(const PassGraph& graph) {
  const std::vector<std::set<int>> before = waits(graph);
  std::vector<int> order;
  std::vector<bool> done(before.size(), false);
  while (order.size() < before.size()) {
    std::size_t next = 0;  // the first in the list that waits for none
    const auto is_ready = [&](std::size_t p) {
      return !done[p] && std::all_of(before[p].begin(), before[p].end(),
                                     [&](int other) { return done[static_cast<std::size_t>(other)]; });
    };
    while (next < before.size() && !is_ready(next)) ++next;
    if (next == before.size()) return {};
    done[next] = true;
    order.push_back(static_cast<int>(next));
  }
  return order;
}

int tile_bytes_per_sample(const PassGraph& graph, const Pass& pass, int frame_bits) {
  constexpr int kDepthBytes = 4, kVisibilityBytes = 16;
  int bits = 0;
  for (const std::string& name : listed_writes(pass))
    if (name == kFrameAttachment)
      bits += frame_bits;
    else if (const Attachment& a = *known(graph, name); !is_depth(a.format))
      bits += sample_bits(a.format);
  const int color_bytes = (bits + 7) / 8;
  if (!draws(pass)) return color_bytes;
  return kDepthBytes + (bits == 0 ? 0 : std::max(kVisibilityBytes, color_bytes));
}

}  // namespace tessera::scene
