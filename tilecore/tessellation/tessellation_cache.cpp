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
  const std::uint32_t range =
      std::uint32_t{r.i0} | std::uint32_t{r.j0} << 8 | std::uint32_t{r.i1} << 16 | std::uint32_t{r.j1} << 24;
  return hash32(name.patch, range, name.segment);
}

void TessellationCache::use(binner::TileIndex tile, std::span<const TessellationRequest> requests,
                            std::span<const SubPatchName> hidden) {
  begin_tile(tile);
  for (const TessellationRequest& request : requests) use_one(request);
  if (eviction_ != CacheEviction::kUses) return;
  for (const SubPatchName& name : hidden)
    if (const auto found = numbers_.find(name); found != numbers_.end()) end_use(found->second);
}

void TessellationCache::begin_tile(binner::TileIndex tile) {
  const std::uint32_t place = order_.place(tile);
  const bool again = place < now_;  // a further round
  tile_ = tile;
  now_ = place;
  if (eviction_ != CacheEviction::kNextUse) return;
  // Uses that did not come (lists are finer than rectangles), and all when tiles begin anew.
  std::vector<std::uint32_t> late;
  for (auto at = leaving_.rbegin(); at != leaving_.rend(); ++at) {
    if (!again && TileOrder::kNever - std::get<0>(*at) >= now_) break;
    late.push_back(std::get<2>(*at));
  }
  for (const std::uint32_t line : late) {
    unfile(line);
    for (const auto& [sub_patch, part] : lines_[line].users) {
      Part& p = sub_patches_[sub_patch].parts[part];
      if (again || p.next_use < now_) p.next_use = order_.next(p.tiles, now_);
    }
    file(line);
  }
}

void TessellationCache::use_one(const TessellationRequest& request) {
  ++counters_.requests;
  const std::uint32_t number = sub_patch_of(request);
  const bool known = sub_patches_[number].lines_on_chip > 0;
  if (!known || sub_patches_[number].uses_left == 0) sub_patches_[number].uses_left = request.uses;
  const int columns = grid_.columns(), column = static_cast<int>(tile_) % columns,
            row = static_cast<int>(tile_) / columns;
  std::uint64_t evaluated = 0, read = 0;
  const auto parts = static_cast<std::uint32_t>(sub_patches_[number].parts.size());
  if (known) counters_.group_tests += parts;
  for (std::uint32_t p = 0; p < parts; ++p) {
    Part& part = sub_patches_[number].parts[p];
    if (known && !part.tiles.contains(column, row)) continue;
    if (eviction_ == CacheEviction::kNextUse) part.next_use = order_.next(part.tiles, now_ + 1);
    std::uint64_t missing = 0;
    for (const std::uint32_t line : part.lines)
      if (line != kNone) missing |= use_line(line, number, p);
    evaluated += count(missing);
    read += count(part.vertices & ~missing);
  }
  end_use(number);
  if (request.moving && !request.deforming) counters_.vertex_transforms += read;
  if (evaluated == 0) {
    ++counters_.cache_hits;
    return;
  }
  ++counters_.sub_patches;
  counters_.domain_evaluations += evaluated;
  counters_.triangles += request.triangles;
  ledger_.read(memory::Unit::kTilecore, memory::Purpose::kPatchData, request.patch_bytes);
}

std::uint32_t TessellationCache::sub_patch_of(const TessellationRequest& request) {
  const auto [found, is_new] =
      numbers_.try_emplace(static_cast<const SubPatchName&>(request), static_cast<std::uint32_t>(sub_patches_.size()));
  if (!is_new) return found->second;
  // Keys at both ends of its part of the shutter.
  std::array<std::uint8_t, 2> keys{0, 0};
  const bool both = request.moving && request.deforming;
  if (both && request.segment == 0) keys = {0, kLastKey};
  if (both && request.segment > 0) keys = {static_cast<std::uint8_t>(request.segment - 1), request.segment};
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
  if (!l.on_chip || std::find(l.users.begin(), l.users.end(), user) == l.users.end()) {
    if (!make_room(line, sub_patch)) {
      if (l.on_chip) evict(line);
      return missing;
    }
    l.users.push_back(user);
    SubPatch& of = sub_patches_[sub_patch];
    if (of.lines_on_chip++ == 0) bytes_ += of.parts.size() * kRectangleBytes;
  }
  l.valid |= wanted;
  l.used = ++uses_;
  file(line);
  return missing;
}

bool TessellationCache::make_room(std::uint32_t line, std::uint32_t sub_patch) {
  Line& l = lines_[line];
  while (true) {
    const SubPatch& of = sub_patches_[sub_patch];
    const std::uint64_t more =
        (l.on_chip ? 0 : l.bytes) + (of.lines_on_chip == 0 ? of.parts.size() * kRectangleBytes : 0);
    if (bytes_ + more <= capacity_) break;
    if (leaving_.empty()) return false;
    const std::uint32_t first = std::get<2>(*leaving_.begin());
    unfile(first);
    evict(first);
  }
  if (!l.on_chip) bytes_ += l.bytes;
  l.on_chip = true;
  return true;
}

void TessellationCache::evict(std::uint32_t line) {
  Line& l = lines_[line];
  for (const auto& [sub_patch, part] : l.users) {
    SubPatch& of = sub_patches_[sub_patch];
    if (--of.lines_on_chip == 0) bytes_ -= of.parts.size() * kRectangleBytes;
  }
  l.users.clear();
  l.valid = 0;
  l.on_chip = false;
  bytes_ -= l.bytes;
}

std::uint64_t TessellationCache::rank_of(const Line& line) {
  if (eviction_ == CacheEviction::kLru) return 0;
  if (eviction_ == CacheEviction::kUses)
    return std::any_of(line.users.begin(), line.users.end(),
                       [&](const auto& user) { return sub_patches_[user.first].uses_left > 0; })
               ? 1
               : 0;
  std::uint32_t next = TileOrder::kNever;
  for (const auto& [sub_patch, part] : line.users) next = std::min(next, sub_patches_[sub_patch].parts[part].next_use);
  return TileOrder::kNever - next;
}

void TessellationCache::file(std::uint32_t line) {
  Line& l = lines_[line];
  l.rank = rank_of(l);
  leaving_.emplace(l.rank, l.used, line);
}

void TessellationCache::unfile(std::uint32_t line) { leaving_.erase({lines_[line].rank, lines_[line].used, line}); }

void TessellationCache::end_use(std::uint32_t sub_patch) {
  SubPatch& of = sub_patches_[sub_patch];
  if (of.lines_on_chip == 0 || of.uses_left == 0 || --of.uses_left > 0 || eviction_ != CacheEviction::kUses) return;
  for (std::uint32_t p = 0; p < of.parts.size(); ++p)
    for (const std::uint32_t line : of.parts[p].lines) {
      if (line == kNone || !lines_[line].on_chip) continue;
      unfile(line);
      file(line);
    }
}

}  // namespace tessera::tilecore
