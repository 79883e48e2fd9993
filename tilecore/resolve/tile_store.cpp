#include "tilecore/resolve/tile_store.h"

#include <algorithm>
#include <span>

#include "base/crc64.h"
#include "base/vec.h"
#include "tilecore/resolve/block_codes.h"

namespace tessera::tilecore {
namespace {

Vec4 stored_pixel(const Image& image, IntRect region, int x, int y) {
  const auto p = image.at(x - region.x0, y - region.y0);
  return {p[0], p[1], p[2], p[3]};
}

void put_pixel(Image& image, IntRect region, int x, int y, const Vec4& color) {
  const auto p = image.at(x - region.x0, y - region.y0);
  for (std::size_t c = 0; c < 4; ++c) p[c] = color[static_cast<int>(c)];
}

}  // namespace

void StoredFrame::forget(std::size_t tiles, IntRect region) {
  known = false;
  signatures.assign(tiles, std::nullopt);
  color = Image(region.width(), region.height(), 4);
}

std::uint64_t TileStore::header_offset(const FrameStore& how, IntRect region) {
  const BlockShape shape = stored_block(how.coder.format());
  const auto samples = static_cast<std::uint64_t>(how.samples);
  if (how.compressed) return pixel_count(touched_blocks(shape, region)) * shape.raw_bytes() * samples;
  return pixel_count(region) * how.coder.pixel_bytes() * samples;
}

std::uint64_t TileStore::header_bytes(const FrameStore& how, IntRect tile) {
  if (!how.compressed) return 0;
  return pixel_count(touched_blocks(stored_block(how.coder.format()), tile)) * kBlockHeaderBytes *
         static_cast<std::uint64_t>(how.samples);
}

std::uint64_t TileStore::frame_bytes(const FrameStore& how, IntRect region) {
  return header_offset(how, region) + header_bytes(how, region);
}

void TileStore::find_codes(const FrameStore& how, const Tile& tile, const Image& color) {
  codes_.clear();
  for (int y = tile.pixels.y0; y < tile.pixels.y1; ++y)
    for (int x = tile.pixels.x0; x < tile.pixels.x1; ++x)
      codes_.push_back(how.coder.code(stored_pixel(color, tile.region, x, y)));
}

bool TileStore::matches(const FrameStore& how, const Tile& tile) {
  std::optional<std::uint64_t>& there = how.before->signatures[tile.number];
  if (tile.open) {
    there.reset();
    return false;
  }
  Crc64 crc;
  crc.add(std::as_bytes(std::span<const PixelCode>(codes_)));
  counters_.signature_bytes += codes_.size() * how.coder.pixel_bytes();
  const std::uint64_t signature = kept_bits(crc.value(), how.signature_bits);
  if (how.before->known && there == signature) return true;
  there = signature;
  return false;
}

bool TileStore::keep_what_is_there(const FrameStore& how, const Tile& tile, Image& color) {
  const Image& before = how.before->color;
  bool same = true;
  std::size_t i = 0;
  for (int y = tile.pixels.y0; y < tile.pixels.y1; ++y)
    for (int x = tile.pixels.x0; x < tile.pixels.x1; ++x) {
      const Vec4 there = stored_pixel(before, tile.region, x, y);
      same = same &&
             (how.samples > 1 ? there == stored_pixel(color, tile.region, x, y) : how.coder.code(there) == codes_[i++]);
    }
  if (same) return false;
  ++counters_.wrong_matches;
  for (int y = tile.pixels.y0; y < tile.pixels.y1; ++y)
    for (int x = tile.pixels.x0; x < tile.pixels.x1; ++x)
      put_pixel(color, tile.region, x, y, stored_pixel(before, tile.region, x, y));
  return true;
}

std::uint64_t TileStore::compressed_bytes(const FrameStore& how, const Tile& tile, int column, int row,
                                          std::size_t sample) const {
  const BlockShape shape = stored_block(how.coder.format());
  if (tile.open) return raw_block_bytes(shape, row, tile.pixels, tile.burst_bytes);
  const auto samples = static_cast<std::size_t>(how.samples);
  if (sample == 0)
    return stored_block_bytes(shape, column, row, tile.pixels, tile.burst_bytes,
                              [&](std::size_t pixel) { return codes_[pixel * samples]; });
  return stored_block_bytes(difference_block(shape), column, row, tile.pixels, tile.burst_bytes,
                            [&](std::size_t pixel) {
                              const PixelCode* const codes = &codes_[pixel * samples];
                              return difference(codes[sample], codes[0], shape.bits);
                            });
}

void TileStore::plan_compressed(const FrameStore& how, const Tile& tile) {
  const BlockShape shape = stored_block(how.coder.format());
  const auto samples = static_cast<std::size_t>(how.samples);
  const IntRect all = touched_blocks(shape, tile.region), blocks = touched_blocks(shape, tile.pixels);
  transfers_.clear();
  for (int row = blocks.y0; row < blocks.y1; ++row)
    for (int column = blocks.x0; column < blocks.x1; ++column) {
      const IntRect block{column * shape.width, row * shape.height, (column + 1) * shape.width,
                          (row + 1) * shape.height};
      const bool kept = tile.unchanged != nullptr && tile.unchanged->any &&
                        tile.unchanged->all({block.x0 / 4, block.y0 / 4, block.x1 / 4, block.y1 / 4});
      for (std::size_t sample = 0; sample < samples; ++sample) {
        const std::size_t number = all.index(column, row) * samples + sample;
        const std::uint64_t bytes = compressed_bytes(how, tile, column, row, sample);
        if (tile.payloads != nullptr) (*tile.payloads)[number] = static_cast<std::uint16_t>(bytes);
        if (!kept) transfers_.push_back({number * shape.raw_bytes(), bytes});
      }
    }
}

void TileStore::plan_payloads(const FrameStore& how, const Tile& tile) {
  const BlockShape shape = stored_block(how.coder.format());
  const auto samples = static_cast<std::size_t>(how.samples);
  const IntRect all = touched_blocks(shape, tile.region), blocks = touched_blocks(shape, tile.pixels);
  transfers_.clear();
  for (int row = blocks.y0; row < blocks.y1; ++row)
    for (int column = blocks.x0; column < blocks.x1; ++column)
      for (std::size_t sample = 0; sample < samples; ++sample) {
        const std::size_t block = all.index(column, row) * samples + sample;
        transfers_.push_back({block * shape.raw_bytes(), (*how.payloads)[block]});
      }
}

void TileStore::plan_rows(const FrameStore& how, const Tile& tile) {
  const TouchedBursts::Array rows = frame_rows(how.coder.pixel_bytes(), tile.region, tile.burst_bytes);
  transfers_.clear();
  for (int y = tile.pixels.y0; y < tile.pixels.y1; ++y)  // a tile's row of pixels is contiguous in memory
    transfers_.push_back({rows.at(tile.pixels.x0, y), static_cast<std::uint64_t>(tile.pixels.width()) * rows.bytes});
}

void TileStore::plan_changed_rows(const FrameStore& how, const Tile& tile) {
  touched_.start(tile.burst_bytes);
  const UnchangedBlocks& kept = *tile.unchanged;
  const TouchedBursts::Array rows = frame_rows(how.coder.pixel_bytes(), tile.region, tile.burst_bytes);
  for (int row = kept.blocks.y0; row < kept.blocks.y1; ++row)
    for (int column = kept.blocks.x0; column < kept.blocks.x1; ++column)
      if (!kept.at(column, row))
        touched_.touch(rows, tile.pixels.intersect({4 * column, 4 * row, 4 * column + 4, 4 * row + 4}));
  transfers_.clear();
  for (const TouchedBursts::Run& run : touched_.runs())
    transfers_.push_back({run.first * tile.burst_bytes, (run.end - run.first) * tile.burst_bytes});
}

TileStore::Outcome TileStore::store(const FrameStore& how, const Tile& tile, Image& color, memory::Ledger& ledger) {
  if (how.samples == 1) {
    if (how.compressed || how.before != nullptr) find_codes(how, tile, color);
    if (how.coder.tone_maps()) counters_.pixels_coded += pixel_count(tile.pixels);
  }
  const bool keeps = tile.unchanged != nullptr && tile.unchanged->any;
  if (how.compressed)
    plan_compressed(how, tile);
  else if (how.by_tile)
    transfers_.clear();
  else if (keeps)
    plan_changed_rows(how, tile);
  else
    plan_rows(how, tile);
  if (how.before != nullptr && matches(how, tile)) {
    ++counters_.tiles_not_written;
    return {false, keep_what_is_there(how, tile, color)};
  }
  if (how.payloads != nullptr)
    for (const Transfer& transfer : transfers_)
      (*how.payloads)[transfer.offset / stored_block(how.coder.format()).raw_bytes()] =
          static_cast<std::uint16_t>(transfer.bytes);
  if (how.compressed && !tile.open)
    counters_.pixels_compressed += transfers_.size() * stored_block(how.coder.format()).pixels();
  for (const Transfer& transfer : transfers_)
    ledger.write_at(memory::Unit::kResolve, how.purpose, how.base + transfer.offset, transfer.bytes, tile.burst_bytes);
  if (how.before != nullptr)
    for (int y = tile.pixels.y0; y < tile.pixels.y1; ++y)
      for (int x = tile.pixels.x0; x < tile.pixels.x1; ++x)
        put_pixel(how.before->color, tile.region, x, y, stored_pixel(color, tile.region, x, y));
  return {!keeps || !transfers_.empty(), false};
}

TileStore::Outcome TileStore::store_attachment(const FrameStore& how, const Tile& tile, Image& color,
                                               memory::Ledger& ledger) {
  // Codes of rounded colours may be other ones: a bright code stands for light that the tone map compresses.
  const Outcome outcome = store(how, tile, color, ledger);
  if (how.samples == 1) round_pixels(how.coder, tile, color);
  return outcome;
}

void TileStore::round_pixels(const PixelCoder& coder, const Tile& tile, Image& color) {
  for (int y = tile.pixels.y0; y < tile.pixels.y1; ++y)
    for (int x = tile.pixels.x0; x < tile.pixels.x1; ++x) {
      Vec4 pixel = stored_pixel(color, tile.region, x, y);
      coder.stored({&pixel, 1}, &pixel);
      put_pixel(color, tile.region, x, y, pixel);
    }
}

void TileStore::round(const PixelCoder& coder, const Tile& tile, Image& color) {
  if (coder.tone_maps()) counters_.pixels_coded += pixel_count(tile.pixels);
  round_pixels(coder, tile, color);
}

void TileStore::round(const PixelCoder& coder, std::span<Vec3> color, std::span<float> coverage, bool signs) {
  if (coder.tone_maps()) counters_.pixels_coded += color.size();
  codes_.clear();
  for (std::size_t s = 0; s < color.size(); ++s) {
    const Vec4 given(color[s], coverage[s]), stored = coder.stored(given);
    if (signs) codes_.push_back(coder.code(given));
    color[s] = Vec3(stored), coverage[s] = stored.w;
  }
}

void TileStore::load(const FrameStore& how, const Tile& tile, memory::Ledger& ledger) {
  if (how.payloads != nullptr)
    plan_payloads(how, tile);
  else if (how.by_tile)
    transfers_.clear();
  else
    plan_rows(how, tile);
  for (const Transfer& transfer : transfers_)
    ledger.read_at(memory::Unit::kTilecore, how.purpose, how.base + transfer.offset, transfer.bytes, tile.burst_bytes);
  if (how.payloads != nullptr)
    counters_.pixels_decompressed +=
        static_cast<std::uint64_t>(std::ranges::count_if(transfers_, [](const Transfer& t) { return t.bytes > 0; })) *
        stored_block(how.coder.format()).pixels();
}

}  // namespace tessera::tilecore
