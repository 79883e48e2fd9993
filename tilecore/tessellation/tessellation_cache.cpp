#include "tilecore/tessellation/tessellation_cache.h"

#include <algorithm>
#include <bit>

#include "base/random.h"

namespace tessera::tilecore {
namespace {

int floor_divide(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

std::uint64_t count(std::uint64_t bits) { return static_cast<std::uint64_t>(std::popcount(bits)); }

}  // namespace

std::size_t SubPatchName::Hash::operator()(const SubPatchName& name) const {
  const auto& r = name.range;
  const std::uint32_t cells =
      std::uint32_t{r.i0} | std::uint32_t{r.j0} << 8 | std::uint32_t{r.i1} << 16 | std::uint32_t{r.j1} << 24;
  return hash32(name.patch, cells, name.segment);
}

void TessellationCache::use(binner::TileIndex tile, std::span<const TessellationRequest> requests,
                            std::span<const SubPatchName> hidden) {
  begin_tile(tile);
  for (const TessellationRequest& request : requests) use_one(request);
  for (const SubPatchName& name : hidden)
    if (const auto found = numbers_.find(name); found != numbers_.end()) end_use(found->second);
}

void TessellationCache::begin_tile(binner::TileIndex tile) {
  const std::uint32_t place = order_.place(tile);
  const bool again = place < now_;  // a further round
  tile_ = tile;
  now_ = place;
  std::vector<std::uint32_t> late;
  for (auto at = leaving_.rbegin(); at != leaving_.rend(); ++at) {
    if (!again && TileOrder::kNever - std::get<0>(*at) >= now_) break;
    late.push_back(std::get<2>(*at));
  }
  for (const std::uint32_t line : late) {
    unfile(line);
    for (const auto& [number, number_of_part] : lines_[line].users) {
      Part& part = sub_patches_[number].parts[number_of_part];
      if (again || part.next_use < now_) part.next_use = order_.next(part.tiles, now_);
    }
    file(line);
  }
}

void TessellationCache::use_one(const TessellationRequest& request) {
  ++counters_.requests;
  const std::uint32_t number = sub_patch_of(request);
  const bool known = sub_patches_[number].known;
  if (!known || sub_patches_[number].uses_left == 0) sub_patches_[number].uses_left = request.uses;
  if (known && sub_patches_[number].lines_on_chip == 0) unfile_outline(number);
  sub_patches_[number].used = ++uses_;
  const int columns = grid_.columns(), column = static_cast<int>(tile_) % columns,
            row = static_cast<int>(tile_) / columns;
  std::uint64_t evaluated = 0, read = 0;
  const auto parts = static_cast<std::uint32_t>(sub_patches_[number].parts.size());
  if (known) counters_.group_tests += parts;
  for (std::uint32_t p = 0; p < parts; ++p) {
    Part& part = sub_patches_[number].parts[p];
    if (known && !part.tiles.contains(column, row)) continue;
    part.next_use = order_.next(part.tiles, now_ + 1);
    std::uint64_t missing = 0;
    for (const std::uint32_t line : part.lines)
      if (line != kNone) missing |= use_line(line, number, p);
    evaluated += count(missing);
    read += count(part.vertices & ~missing);
  }
  keep_outline(number);
  end_use(number);
  if (request.moving && !request.deforming) counters_.vertex_transforms += read;
  if (evaluated == 0) return;
  ++counters_.sub_patches;
  counters_.domain_evaluations += evaluated;
  counters_.triangles += request.triangles;
}

std::uint32_t TessellationCache::sub_patch_of(const TessellationRequest& request) {
  const auto [found, is_new] =
      numbers_.try_emplace(static_cast<const SubPatchName&>(request), static_cast<std::uint32_t>(sub_patches_.size()));
  if (!is_new) return found->second;
  // Keys at both ends of its part of the shutter.
  std::array<std::uint16_t, 2> keys{0, 0};
  const bool both = request.moving && request.deforming;
  if (both && request.segment == 0) keys = {0, kLastKey};
  if (both && request.segment > 0) keys = {static_cast<std::uint16_t>(request.segment - 1), request.segment};
  SubPatch& made = sub_patches_.emplace_back();
  for (const VertexGroup& group : *request.groups) {
    Part& part = made.parts.emplace_back();
    part.vertices = group.vertices;
    part.tiles = tiles_of(group.pixels);
    std::uint64_t first = 0;
    for (std::size_t k = 0; k < (both ? 2u : 1u); ++k) {
      part.lines[k] = line_of(request.patch, group.number, keys[k], group.room * kPositionBytes);
      std::uint64_t& ever = lines_[part.lines[k]].ever;
      first |= part.vertices & ~ever;
      ever |= part.vertices;
    }
    counters_.compulsory_evaluations += count(first);
  }
  return found->second;
}

IntRect TessellationCache::tiles_of(const IntRect& pixels) const {
  if (pixels.empty()) return {};
  const int x = grid_.column_edge(0), y = grid_.row_edge(0), width = grid_.tile_width(), height = grid_.tile_height();
  return IntRect{floor_divide(pixels.x0 - x, width), floor_divide(pixels.y0 - y, height),
                 floor_divide(pixels.x1 - 1 - x, width) + 1, floor_divide(pixels.y1 - 1 - y, height) + 1}
      .intersect({0, 0, grid_.columns(), grid_.rows()});
}

std::uint32_t TessellationCache::line_of(std::uint32_t patch, std::uint32_t group, std::uint8_t key,
                                         std::uint64_t bytes) {
  const std::uint64_t name = std::uint64_t{patch} << 32 | group << 8 | key;
  const auto [found, is_new] = line_numbers_.try_emplace(name, static_cast<std::uint32_t>(lines_.size()));
  if (is_new) lines_.emplace_back().bytes = bytes;
  return found->second;
}

std::uint64_t TessellationCache::use_line(std::uint32_t line, std::uint32_t sub_patch, std::uint32_t part) {
  Line& l = lines_[line];
  const std::uint64_t wanted = sub_patches_[sub_patch].parts[part].vertices;
  const std::uint64_t missing = wanted & ~l.valid;
  if (l.on_chip) unfile(line);
  const std::pair<std::uint32_t, std::uint32_t> user{sub_patch, part};
  if (!l.on_chip && passes_by(l, sub_patch, part)) return missing;
  if (!l.on_chip || std::find(l.users.begin(), l.users.end(), user) == l.users.end()) {
    if (!make_room(line, sub_patch)) {
      if (l.on_chip) evict(line);
      return missing;
    }
    l.users.push_back(user);
    ++sub_patches_[sub_patch].lines_on_chip;
  }
  l.valid |= wanted;
  l.used = ++uses_;
  file(line);
  return missing;
}

bool TessellationCache::passes_by(const Line& line, std::uint32_t sub_patch, std::uint32_t part) const {
  const SubPatch& of = sub_patches_[sub_patch];
  if (bytes_ + line.bytes + (of.known ? 0 : outline_bytes(of)) <= capacity_ || leaving_.empty()) return false;
  // This use is one of the remaining ones.
  return (of.uses_left > 1 ? rank_of(sub_patch, of.parts[part]) : 0) < std::get<0>(*leaving_.begin());
}

void TessellationCache::keep_outline(std::uint32_t sub_patch) {
  SubPatch& of = sub_patches_[sub_patch];
  if (!of.known) {
    const std::uint64_t bytes = outline_bytes(of);
    while (bytes_ + bytes > capacity_ && !leaving_outlines_.empty()) forget(leaving_outlines_.begin()->second);
    if (bytes_ + bytes > capacity_) return;
    of.known = true;
    bytes_ += bytes;
  }
  if (of.lines_on_chip == 0) file_outline(sub_patch);
}

bool TessellationCache::make_room(std::uint32_t line, std::uint32_t sub_patch) {
  Line& l = lines_[line];
  SubPatch& of = sub_patches_[sub_patch];
  const std::uint64_t more = (l.on_chip ? 0 : l.bytes) + (of.known ? 0 : outline_bytes(of));
  ++of.lines_on_chip;  // its outline stays whichever line leaves
  while (bytes_ + more > capacity_ && !leaving_.empty()) {
    const std::uint32_t first = std::get<2>(*leaving_.begin());
    unfile(first);
    evict(first);
  }
  while (bytes_ + more > capacity_ && !leaving_outlines_.empty()) forget(leaving_outlines_.begin()->second);
  --of.lines_on_chip;
  if (bytes_ + more > capacity_) return false;
  bytes_ += more;
  l.on_chip = of.known = true;
  return true;
}

void TessellationCache::evict(std::uint32_t line) {
  Line& l = lines_[line];
  for (const auto& [sub_patch, part] : l.users)
    if (--sub_patches_[sub_patch].lines_on_chip == 0) file_outline(sub_patch);
  l.users.clear();
  l.valid = 0;
  l.on_chip = false;
  bytes_ -= l.bytes;
}

void TessellationCache::forget(std::uint32_t sub_patch) {
  unfile_outline(sub_patch);
  sub_patches_[sub_patch].known = false;
  bytes_ -= outline_bytes(sub_patches_[sub_patch]);
}

// Lines with a higher rank stay longer.
std::uint64_t TessellationCache::rank_of(std::uint32_t sub_patch, const Part& part) const {
  if (sub_patches_[sub_patch].uses_left == 0) return 0;
  return TileOrder::kNever - part.next_use;
}

void TessellationCache::file(std::uint32_t line) {
  Line& l = lines_[line];
  l.rank = 0;
  for (const auto& [sub_patch, part] : l.users)
    l.rank = std::max(l.rank, rank_of(sub_patch, sub_patches_[sub_patch].parts[part]));
  leaving_.emplace(l.rank, l.used, line);
}

void TessellationCache::unfile(std::uint32_t line) { leaving_.erase({lines_[line].rank, lines_[line].used, line}); }

void TessellationCache::file_outline(std::uint32_t sub_patch) {
  SubPatch& of = sub_patches_[sub_patch];
  leaving_outlines_.emplace(of.used, sub_patch);
  outline_bytes_ += outline_bytes(of);
  if (of.uses_left == 0) return forget(sub_patch);
  while (outline_bytes_ > capacity_ / kOutlineShare) forget(leaving_outlines_.begin()->second);
}

void TessellationCache::unfile_outline(std::uint32_t sub_patch) {
  const SubPatch& of = sub_patches_[sub_patch];
  leaving_outlines_.erase({of.used, sub_patch});
  outline_bytes_ -= outline_bytes(of);
}

void TessellationCache::end_use(std::uint32_t sub_patch) {
  SubPatch& of = sub_patches_[sub_patch];
  if (!of.known || of.uses_left == 0 || --of.uses_left > 0) return;
  if (of.lines_on_chip == 0) return forget(sub_patch);
  for (const Part& part : of.parts)
    for (const std::uint32_t line : part.lines) {
      if (line == kNone || !lines_[line].on_chip) continue;
      unfile(line);
      file(line);
    }
}

}  // namespace tessera::tilecore
