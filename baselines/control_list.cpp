#include "baselines/control_list.h"

#include <cstdlib>

#include "base/bit_stream.h"

namespace tessera::baselines {
namespace {

constexpr std::int64_t kBlockBytes = 64;
constexpr unsigned kFreshTriangle = 3, kStatePacket = 7;
constexpr std::int32_t kNear = 15;
constexpr unsigned kFar = 31;

std::int32_t distance(std::uint32_t vertex, std::uint32_t from) { return static_cast<std::int32_t>(vertex - from); }

void put_packet(unsigned code, std::int32_t distance, std::vector<std::uint8_t>& bytes) {
  const bool near = distance >= -kNear && distance <= kNear;
  bytes.push_back(static_cast<std::uint8_t>(code | (near ? static_cast<unsigned>(distance + kNear) : kFar) << 3));
  if (!near) put_number(zigzag(distance), bytes);
}

gpu::GpuConfiguration in_blocks(gpu::GpuConfiguration gpu) {
  gpu.parameter_buffer.first_chunk_bytes = gpu.parameter_buffer.chunk_bytes = kBlockBytes;
  return gpu;
}

}  // namespace

ControlListBinner::ControlListBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid)
    : lists_(in_blocks(gpu), grid), last_(grid.tile_count()) {}

void ControlListBinner::put_triangle(const Triangle& triangle, Place& place, std::vector<std::uint8_t>& bytes) const {
  const Triangle p = place.before;
  place.before = triangle;
  for (unsigned k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t from = p[(k + 1) % 3], to = p[k];
      if (triangle[(c + 1) % 3] != from || triangle[(c + 2) % 3] != to) continue;
      const std::int32_t first = distance(triangle[c], from), second = distance(triangle[c], to);
      const bool use_second = std::abs(second) < std::abs(first);
      put_packet(k | (use_second ? 4u : 0u), use_second ? second : first, bytes);
      place.before = {from, to, triangle[c]};
      return;
    }
  put_packet(kFreshTriangle, distance(triangle[0], p[2]), bytes);
  put_number(zigzag(distance(triangle[1], triangle[0])), bytes);
  put_number(zigzag(distance(triangle[2], triangle[0])), bytes);
}

void ControlListBinner::add(const TessellatedPatch& patch, const TriangleList& list) {
  const std::uint32_t first = lists_.reshading().add(patch, list);
  std::vector<std::uint8_t> bytes;
  std::size_t tile = 0;
  for (const TriangleList::Triangle& t : list.triangles) {
    const Triangle triangle = {first + t.vertex[0], first + t.vertex[1], first + t.vertex[2]};
    for (; tile < t.tiles_end; ++tile) {
      Place& place = last_[list.tiles[tile]];
      bytes.clear();
      if (place.state != patch.state) {
        bytes.push_back(kStatePacket);
        for (unsigned b = 0; b < 4; ++b) bytes.push_back(static_cast<std::uint8_t>(patch.state >> (8 * b)));
        place.state = patch.state;
      }
      put_triangle(triangle, place, bytes);
      lists_.append(list.tiles[tile], bytes);
      ++lists_.counters().entries;
    }
  }
}

std::unique_ptr<Scheme> make_control_list() {
  return std::make_unique<ReferenceScheme<ControlListBinner, false, false>>();
}

}  // namespace tessera::baselines
