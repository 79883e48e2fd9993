#include "timing/work_code.h"

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace tessera::timing {
namespace {

// Calls visit(member) for every number of a record in order; `Work` may be const.
template <class Work, class Visit>
void each_number(Work& work, const Visit& visit) requires std::is_same_v<std::remove_const_t<Work>, GeometryWork> {
  auto& [events, patches, dram_bytes, table_bytes, written_bytes, queue_bytes, vertex_clocks] = work;
  for (auto& count : events) visit(count);
  visit(patches), visit(dram_bytes), visit(table_bytes), visit(written_bytes), visit(queue_bytes), visit(vertex_clocks);
}

template <class Work, class Visit>
void each_number(Work& work, const Visit& visit) requires std::is_same_v<std::remove_const_t<Work>, TileWork> {
  auto& [tile, events, sub_patches, dram_bytes, extra_bytes] = work;
  visit(tile), visit(sub_patches), visit(extra_bytes);
  for (auto& count : events) visit(count);
  for (auto& bytes : dram_bytes) visit(bytes);
}

template <class Item, class Visit>
void each_number(Item& item, const Visit& visit) requires std::is_same_v<std::remove_const_t<Item>, SubPatchItem> {
  auto& [events, domain_clocks, domain_registers, domain_texels, lines, height_lines, texel_lines, drawable] = item;
  for (auto& count : events) visit(count);
  visit(domain_clocks), visit(domain_registers), visit(domain_texels);
  visit(lines), visit(height_lines), visit(texel_lines), visit(drawable);
}

template <class Item, class Visit>
void each_number(Item& item, const Visit& visit) requires std::is_same_v<std::remove_const_t<Item>, WarpItem> {
  auto& [lanes, kind, clocks, registers, texels, texel_lines, drawable] = item;
  visit(lanes), visit(kind), visit(clocks), visit(registers), visit(texels), visit(texel_lines), visit(drawable);
}

// The numbers of a tile's items, without its lists.
template <class Items, class Visit>
void each_number(Items& items, const Visit& visit) requires std::is_same_v<std::remove_const_t<Items>, TileItems> {
  visit(items.shading_lines), visit(items.list_bytes), visit(items.record_bytes), visit(items.load_bytes);
  visit(items.resolve_bytes), visit(items.written_bytes), visit(items.cache_lines);
}

class Writer {
 public:
  void number(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(0x80 | (value & 0x7F)));
    bytes_.push_back(static_cast<char>(value));
  }
  void lines(const std::vector<std::uint32_t>& lines) {
    number(lines.size());
    std::uint32_t last = 0;
    for (const std::uint32_t line : lines) {
      const auto step = static_cast<std::int32_t>(line - std::exchange(last, line));
      number(static_cast<std::uint32_t>(step) << 1 ^ static_cast<std::uint32_t>(step >> 31));
    }
  }
  void text(std::string_view text) {
    number(text.size());
    bytes_ += text;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
      if (at_ == bytes_.size()) throw BadWork{"ends inside a number"};
      const auto byte = static_cast<unsigned char>(bytes_[at_++]);
      if (shift == 63 && byte > 1) throw BadWork{"a number of more than 64 bits"};
      value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      if (byte < 0x80) {
        if (byte == 0 && shift > 0) throw BadWork{"a number that is longer than it need be"};
        return value;
      }
    }
  }
  template <class T>
  void into(T& member) {
    const std::uint64_t value = number();
    if (value > std::uint64_t{T(-1)}) throw BadWork{"a number that is too large"};
    member = static_cast<T>(value);
  }
  // The length of a list whose elements take at least one byte each.
  std::size_t length() {
    const std::uint64_t value = number();
    if (value > bytes_.size() - at_) throw BadWork{"a list longer than the rest"};
    return static_cast<std::size_t>(value);
  }
  void lines(std::vector<std::uint32_t>& lines) {
    lines.resize(length());
    std::uint32_t last = 0;
    for (std::uint32_t& line : lines) {
      std::uint32_t code = 0;
      into(code);
      line = last += code >> 1 ^ (~(code & 1) + 1);
    }
  }
  std::string text() {
    const std::size_t size = length();
    at_ += size;
    return std::string(bytes_.substr(at_ - size, size));
  }
  void end() const {
    if (at_ != bytes_.size()) throw BadWork{"continues behind its end"};
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

// Checks that items take as many lines as the lists hold.
void check_lines(const TileItems& items) {
  std::uint64_t lines = items.shading_lines, texel_lines = 0;
  for (const SubPatchItem& item : items.sub_patches) {
    lines += item.lines, texel_lines += item.texel_lines;
    if (item.height_lines > item.lines) throw BadWork{"more lines of heights than lines"};
  }
  for (const WarpItem& item : items.warps) texel_lines += item.texel_lines;
  if (lines != items.lines.size() || texel_lines != items.texel_lines.size())
    throw BadWork{"items that ask for other lines than there are"};
}

}  // namespace

std::string encode(const FrameWork& work) {
  Writer out;
  const auto write = [&](std::uint64_t value) { out.number(value); };
  out.number(work.passes.size());
  for (const std::string& pass : work.passes) out.text(pass);
  out.number(work.stored_lines.size());
  for (const memory::LineRange& lines : work.stored_lines) out.number(lines.first), out.number(lines.end);
  out.number(work.rounds.size());
  for (const WorkRound& round : work.rounds) {
    out.number(round.pass), out.number(round.geometry_after), out.number(round.tiles_after);
    each_number(round.geometry, write);
    out.number(round.tiles.size());
    for (const TileWork& tile : round.tiles) each_number(tile, write);
    out.lines(round.geometry_lines);
    out.number(round.items.size());
    for (const TileItems& items : round.items) {
      each_number(items, write);
      out.number(items.sub_patches.size());
      for (const SubPatchItem& item : items.sub_patches) each_number(item, write);
      out.number(items.warps.size());
      for (const WarpItem& item : items.warps) each_number(item, write);
      out.lines(items.lines);
      out.lines(items.texel_lines);
    }
  }
  out.number(work.tile_state_bytes);
  out.number(work.other_bytes);
  out.number(work.other_written_bytes);
  return out.take();
}

FrameWork decode(std::string_view bytes) {
  Reader in(bytes);
  const auto read = [&](auto& member) { in.into(member); };
  FrameWork work;
  for (std::size_t left = in.length(); left > 0; --left) work.passes.push_back(in.text());
  for (std::size_t left = in.length(); left > 0; --left) {
    memory::LineRange& lines = work.stored_lines.emplace_back();
    in.into(lines.first), in.into(lines.end);
  }
  const std::size_t rounds = in.length();
  for (std::size_t r = 0; r < rounds; ++r) {
    WorkRound& round = work.rounds.emplace_back();
    in.into(round.pass), in.into(round.geometry_after), in.into(round.tiles_after);
    if (round.pass >= work.passes.size()) throw BadWork{"a round of a pass that there is not"};
    each_number(round.geometry, read);
    const std::size_t tiles = in.length();
    for (std::size_t t = 0; t < tiles; ++t) each_number(round.tiles.emplace_back(), read);
    in.lines(round.geometry_lines);
    const std::size_t item_lists = in.length();
    if (item_lists != 0 && item_lists != tiles) throw BadWork{"items of some tiles only"};
    for (std::size_t t = 0; t < item_lists; ++t) {
      TileItems& items = round.items.emplace_back();
      each_number(items, read);
      for (std::size_t left = in.length(); left > 0; --left) each_number(items.sub_patches.emplace_back(), read);
      for (std::size_t left = in.length(); left > 0; --left) each_number(items.warps.emplace_back(), read);
      in.lines(items.lines);
      in.lines(items.texel_lines);
      check_lines(items);
    }
  }
  in.into(work.tile_state_bytes);
  in.into(work.other_bytes);
  in.into(work.other_written_bytes);
  in.end();
  return work;
}

}  // namespace tessera::timing
