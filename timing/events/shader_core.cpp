#include "timing/events/shader_core.h"

#include <algorithm>
#include <functional>
#include <numeric>

namespace tessera::timing {

using hardware::Stage;

ShaderCore::Rates ShaderCore::rates_of(const hardware::Machine& gpu) {
  return {gpu.shader.operations,
          gpu.shader.surface_operations,
          gpu.shader.background_operations,
          gpu.operations(Event::kLightLanes),
          gpu.operations(Event::kImageLanes),
          static_cast<double>(gpu.shader.lanes),
          static_cast<std::uint32_t>(gpu.shader.warp_lanes),
          gpu.per_clk(Event::kTexels),
          static_cast<double>(gpu.shader.warp_lanes) / gpu.per_clk(Event::kCompactedSamples),
          static_cast<std::size_t>(gpu.queues.max_warps),
          static_cast<double>(gpu.queues.register_bytes),
          static_cast<double>(gpu.queues.registers),
          1,
          gpu.shader.costs == hardware::ShaderCosts::kCompiled};
}

ShaderCore::ShaderCore(std::uint32_t core, const Rates& rates, EventQueue& events, TexturePath& textures)
    : core_(core), rates_(rates), events_(events), textures_(textures) {}

void ShaderCore::begin(const TileItems& items, double now) {
  count_idle(now);
  items_ = &items;
  warps_.assign(items.warps.size(), {});
  std::uint32_t line = 0;
  for (const SubPatchItem& item : items.sub_patches) line += item.texel_lines;
  for (std::size_t w = 0; w < warps_.size(); ++w) {
    warps_[w].first_line = line;
    line += items.warps[w].texel_lines;
  }
  next_ = oldest_ = done_ = 0;
  steps_in_flight_ = {};
  began_ = now;
  reason_ = Stall::kNoWarp;
  if (warps_.empty())
    events_.push(now, Stage::kShader, EventKind::kShaded, core_);
  else
    launch(now);
}

void ShaderCore::shade_vertices(std::uint32_t number, const SubPatchItem& item, const std::uint32_t* height_lines,
                                double now) {
  count_idle(now);
  if (free_vertices_.empty()) {
    free_vertices_.push_back(static_cast<std::uint32_t>(vertices_.size()));
    vertices_.emplace_back();
  }
  const std::uint32_t place = free_vertices_.back();
  free_vertices_.pop_back();
  const std::uint32_t warps = (item[Event::kVertices] + rates_.warp_lanes - 1) / rates_.warp_lanes;
  vertices_[place] = {number, &item, height_lines, warps};
  domain_.vertices += item[Event::kVertices];
  domain_.warps += warps;
  to_launch_.push_back(place);
  launch(now);
}

double ShaderCore::cycles(std::uint32_t warp, bool first_part) const {
  const WarpItem& item = items_->warps[warp];
  const double constant = item.kind == WarpItem::kVertices     ? rates_.surface_operations
                          : item.kind == WarpItem::kBackground ? rates_.background_operations
                          : item.makes_lights()                ? rates_.light_operations
                          : item.kind == WarpItem::kImage      ? rates_.image_operations
                          : item.kind == WarpItem::kEvaluating ? rates_.operations + rates_.surface_operations
                                                               : rates_.operations,
               operations = rates_.compiled ? item.clocks * rates_.compiled_clk : constant,
               all = operations * rates_.warp_lanes / rates_.lanes;
  if (item.texels == 0) return all;
  return all * (first_part ? kBeforeLookups : 1 - kBeforeLookups);
}

double ShaderCore::domain_cycles(const DomainWarp& warp) const {
  const SubPatchItem& item = *vertices_[warp.of].item;
  const double all = (rates_.compiled ? item.domain_clocks * rates_.compiled_clk : rates_.surface_operations) *
                     rates_.warp_lanes / rates_.lanes;
  if (item.domain_texels == 0) return all;
  return all * (warp.state == State::kFirst ? kBeforeLookups : 1 - kBeforeLookups);
}

double ShaderCore::pixel_registers(std::uint32_t warp) const {
  return register_bytes(rates_.compiled ? items_->warps[warp].registers : rates_.registers);
}

double ShaderCore::domain_registers(const SubPatchItem& item) const {
  return register_bytes(rates_.compiled ? item.domain_registers : rates_.registers);
}

void ShaderCore::launch(double now) {
  // Waiting vertices are not overtaken: pixels would leave no room to a warp with many registers.
  if (launch_vertices()) launch_pixels(now);
  issue(now);
}

bool ShaderCore::launch_vertices() {
  while (!to_launch_.empty()) {
    const std::uint32_t place = to_launch_.front();
    Vertices& of = vertices_[place];
    for (; of.launched < of.warps; ++of.launched) {
      const double registers = domain_registers(*of.item);
      if (!fits(registers)) return false;
      ++in_flight_;
      registers_taken_ += registers;
      if (free_domain_warps_.empty()) {
        free_domain_warps_.push_back(static_cast<std::uint32_t>(domain_warps_.size()));
        domain_warps_.emplace_back();
      }
      const std::uint32_t warp = free_domain_warps_.back();
      free_domain_warps_.pop_back();
      domain_warps_[warp] = {State::kFirst, place, of.launched, domain_order_++};
      make_ready(domain_warps_[warp].order, warp);
    }
    to_launch_.pop_front();
  }
  return true;
}

void ShaderCore::launch_pixels(double now) {
  packing_ = false;
  while (next_ < warps_.size() && in_flight_ < rates_.max_warps) {
    const std::uint32_t step = items_->warps[next_].step();
    // The vertices or lights of this warp are not ready.
    if (std::any_of(steps_in_flight_.begin(), steps_in_flight_.begin() + step, [](auto n) { return n > 0; })) break;
    const double packed = began_ + rates_.compaction_clk * (next_ + 1);
    if (packed > now) {
      if (!packing_) events_.push(packed, Stage::kCompaction, EventKind::kWarpReady, core_);
      packing_ = true;
      break;
    }
    if (!fits(pixel_registers(next_))) break;
    ++in_flight_;
    registers_taken_ += pixel_registers(next_);
    ++steps_in_flight_[step];
    warps_[next_].state = State::kFirst;
    make_ready(kOfPixels | next_, next_);
    ++next_;
  }
}

void ShaderCore::make_ready(std::uint64_t order, std::uint32_t warp) {
  ready_.emplace_back(order, warp);
  std::push_heap(ready_.begin(), ready_.end(), std::greater<>());
}

void ShaderCore::issue(double now) {
  if (issuing_) return;
  count_idle(now);
  if (ready_.empty()) {
    wait_for_what();
    return;
  }
  std::pop_heap(ready_.begin(), ready_.end(), std::greater<>());
  on_lanes_ = ready_.back();
  ready_.pop_back();
  const std::uint32_t warp = on_lanes_.second;
  const bool of_pixels = on_lanes_.first >= kOfPixels;
  const double clk = of_pixels ? cycles(warp, warps_[warp].state == State::kFirst) : domain_cycles(domain_warps_[warp]);
  busy_ += clk;
  if (!of_pixels) domain_.lanes_busy += clk;
  idle_since_ = now + clk;
  issuing_ = true;
  events_.push(now + clk, Stage::kShader, EventKind::kIssue, core_);
}

void ShaderCore::wait_for_what() {
  // The oldest warp in flight gives the reason of the wait: of vertices if there is one, else of pixels.
  const DomainWarp* oldest = nullptr;
  for (const DomainWarp& warp : domain_warps_)
    if (warp.state != State::kDone && (oldest == nullptr || warp.order < oldest->order)) oldest = &warp;
  while (oldest_ < next_ && warps_[oldest_].state == State::kDone) ++oldest_;
  if (oldest == nullptr && oldest_ == next_) {
    reason_ = done_ == warps_.size() ? Stall::kNoTile : Stall::kNoWarp;
    return;
  }
  const State state = oldest != nullptr ? oldest->state : warps_[oldest_].state;
  reason_ = state == State::kLookUp ? Stall::kTexture : Stall::kMemory;
}

void ShaderCore::count_idle(double now) {
  if (now > idle_since_) stalls_[static_cast<std::size_t>(reason_)] += now - idle_since_;
  idle_since_ = std::max(idle_since_, now);
}

void ShaderCore::lanes_free(double now) {
  issuing_ = false;
  const std::uint32_t warp = on_lanes_.second;
  if (on_lanes_.first < kOfPixels) {
    if (domain_warps_[warp].state == State::kFirst && vertices_[domain_warps_[warp].of].item->domain_texels > 0) {
      look_heights_up(warp);
      issue(now);
    } else {
      finish_domain(warp, now);
    }
    return;
  }
  const WarpItem& item = items_->warps[warp];
  if (warps_[warp].state == State::kFirst && item.texels > 0) {
    warps_[warp].state = State::kLookUp;
    textures_.submit(items_->texel_lines.data() + warps_[warp].first_line, item.texel_lines,
                     item.texels / rates_.texels_per_clk, EventKind::kWarpRead, warp);
    issue(now);
    return;
  }
  finish(warp, now);
}

void ShaderCore::look_heights_up(std::uint32_t warp) {
  DomainWarp& d = domain_warps_[warp];
  d.state = State::kLookUp;
  const Vertices& of = vertices_[d.of];
  // Lines of neighbouring vertices lie together; the last warp gets the remaining vertices.
  const auto first_of = [&](std::uint64_t place) {
    return static_cast<std::uint32_t>(of.item->height_lines * place / of.warps);
  };
  const std::uint32_t lanes = std::min(rates_.warp_lanes, (*of.item)[Event::kVertices] - d.place * rates_.warp_lanes),
                      first = first_of(d.place);
  domain_.texels += std::uint64_t{lanes} * of.item->domain_texels;
  textures_.submit(of.height_lines + first, first_of(d.place + 1) - first,
                   static_cast<double>(lanes) * of.item->domain_texels / rates_.texels_per_clk, EventKind::kDomainRead,
                   warp);
}

void ShaderCore::texels_read(std::uint32_t warp, double now) {
  warps_[warp].state = State::kLast;
  make_ready(kOfPixels | warp, warp);
  issue(now);
}

void ShaderCore::heights_read(std::uint32_t warp, double now) {
  domain_warps_[warp].state = State::kLast;
  make_ready(domain_warps_[warp].order, warp);
  issue(now);
}

void ShaderCore::finish(std::uint32_t warp, double now) {
  warps_[warp].state = State::kDone;
  --in_flight_;
  registers_taken_ -= pixel_registers(warp);
  --steps_in_flight_[items_->warps[warp].step()];
  if (++done_ == warps_.size()) events_.push(now, Stage::kShader, EventKind::kShaded, core_);
  launch(now);
}

void ShaderCore::finish_domain(std::uint32_t warp, double now) {
  DomainWarp& d = domain_warps_[warp];
  d.state = State::kDone;
  free_domain_warps_.push_back(warp);
  Vertices& of = vertices_[d.of];
  --in_flight_;
  registers_taken_ -= domain_registers(*of.item);
  if (++of.done == of.warps) {
    events_.push(now, Stage::kShader, EventKind::kDomainShaded, core_, of.number);
    free_vertices_.push_back(d.of);
  }
  launch(now);
}

}  // namespace tessera::timing
