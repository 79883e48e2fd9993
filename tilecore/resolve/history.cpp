#include "tilecore/resolve/history.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/large_pages.h"

namespace tessera::tilecore {
namespace {

// Head of a file; the arrays follow in the order in which History declares them.
struct Head {
  std::array<char, 8> magic{'T', 'S', 'R', 'H', 'I', 'S', 'T', '4'};
  std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  std::int64_t frame = 0;
  std::array<Vec2, 9> camera{};
  std::uint64_t camera_known = 0;
  std::uint64_t payloads = 0, cells = 0;
};
static_assert(sizeof(Head) == 128);

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
void extract(std::ifstream& in, std::vector<T>& values) {
  in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

}  // namespace

History::History(IntRect region_in) : region(region_in) {
  const auto pixels = static_cast<std::size_t>(region.width()) * static_cast<std::size_t>(region.height());
  const auto blocks = static_cast<std::size_t>(block_columns()) * static_cast<std::size_t>(block_rows());
  reserve_in_large_pages(color, pixels);
  reserve_in_large_pages(depth, pixels);
  reserve_in_large_pages(surface, pixels);
  color.assign(pixels, Vec4(0.0f));
  depth.assign(pixels, std::numeric_limits<float>::infinity());
  surface.assign(pixels, 0);
  memory.assign(blocks, 0);
  reject.assign(blocks, 0);
  contrast.assign(blocks, 0);
  stay.assign(blocks, kUnknown);
}

bool History::rejected_around(int x, int y) const {
  const int column = x / 4 - region.x0 / 4, row = y / 4 - region.y0 / 4;
  for (int r = std::max(0, row - 1); r <= std::min(block_rows() - 1, row + 1); ++r)
    for (int c = std::max(0, column - 1); c <= std::min(block_columns() - 1, column + 1); ++c)
      if (reject[static_cast<std::size_t>(r) * static_cast<std::size_t>(block_columns()) +
                 static_cast<std::size_t>(c)] != 0)
        return true;
  return false;
}

std::string History::bytes() const {
  Head head;
  head.x0 = region.x0, head.y0 = region.y0, head.x1 = region.x1, head.y1 = region.y1;
  head.frame = frame;
  head.camera = camera.pixels, head.camera_known = camera.known ? 1 : 0;
  head.payloads = payload.size(), head.cells = cells.size();
  std::string bytes(reinterpret_cast<const char*>(&head), sizeof head);
  append(bytes, color);
  append(bytes, depth);
  append(bytes, surface);
  append(bytes, memory);
  append(bytes, reject);
  append(bytes, contrast);
  append(bytes, stay);
  append(bytes, payload);
  append(bytes, cells);
  return bytes;
}

void History::save(const std::filesystem::path& file) const { write_file_atomically(file, bytes()); }

History History::restore(const std::filesystem::path& file, std::uint64_t max_pixels) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) throw InputError(file.string(), "", "no such file");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string(), "", "cannot be read");
  Head head;
  const auto magic = head.magic;
  in.read(reinterpret_cast<char*>(&head), sizeof head);
  if (!in || head.magic != magic) throw InputError(file.string(), "byte 0", "is not a history of the resolve unit");
  constexpr int kMaxSide = 1 << 20;
  const auto side_fits = [](int low, int high) { return low >= 0 && high > low && high <= kMaxSide; };
  if (!side_fits(head.x0, head.x1) || !side_fits(head.y0, head.y1))
    throw InputError(file.string(), "byte 8", "the region is empty or too large");
  const IntRect region{head.x0, head.y0, head.x1, head.y1};
  const std::uint64_t pixels = static_cast<std::uint64_t>(region.width()) * static_cast<std::uint64_t>(region.height());
  if (pixels > max_pixels)
    throw LimitError(
        fmt::format("{}: a history of {} pixels; {} are expected at most", file.string(), pixels, max_pixels));
  // The file must be as long as its head says, before memory is taken for it.
  const auto columns = static_cast<std::uint64_t>((region.x1 + 3) / 4 - region.x0 / 4),
             rows = static_cast<std::uint64_t>((region.y1 + 3) / 4 - region.y0 / 4);
  // Neither are smaller than a block.
  if (head.payloads > columns * rows || head.cells > columns * rows)
    throw InputError(file.string(), "byte 112", "there are more sizes than blocks");
  const std::uint64_t expected = sizeof head + pixels * (sizeof(Vec4) + sizeof(float) + sizeof(std::uint32_t)) +
                                 columns * rows * 4 + (head.payloads + head.cells) * sizeof(std::uint16_t);
  if (std::filesystem::file_size(file) != expected)
    throw InputError(file.string(),
                     fmt::format("byte {}", std::min<std::uint64_t>(expected, std::filesystem::file_size(file))),
                     fmt::format("{} bytes are expected", expected));
  History out(region);
  out.payload.resize(head.payloads);
  out.cells.resize(head.cells);
  out.frame = head.frame;
  out.camera = {head.camera_known != 0, head.camera};
  extract(in, out.color);
  extract(in, out.depth);
  extract(in, out.surface);
  extract(in, out.memory);
  extract(in, out.reject);
  extract(in, out.contrast);
  extract(in, out.stay);
  extract(in, out.payload);
  extract(in, out.cells);
  if (!in) throw InputError(file.string(), "", "cannot be read to its end");
  return out;
}

}  // namespace tessera::tilecore
