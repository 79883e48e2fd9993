#include "gpu/stored_arrays.h"

#include <algorithm>
#include <utility>

#include "base/check.h"
#include "base/round_up.h"
#include "gpu/input_signatures.h"
#include "tilecore/resolve/block_codes.h"
#include "tilecore/shading/gbuffer_texels.h"

namespace tessera::gpu {
namespace {

using memory::Purpose;
using memory::Unit;
using tilecore::BlockShape;
using tilecore::StoreCounters;
using tilecore::TexelFormat;

std::vector<IntRect> tiles_of(const binner::TileGrid& grid) {
  std::vector<IntRect> all;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) all.push_back(grid.pixels(tile));
  return all;
}

// The texels of a level that tiles own; with compression the blocks whose first texel they own.
std::vector<IntRect> parts_of_level(const Bloom& bloom, std::size_t level, const binner::TileGrid& grid, bool blocks) {
  const std::array<int, 2> size = bloom.size(level);
  const BlockShape shape = bloom.texel_format().planes[0];
  std::vector<IntRect> all;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    IntRect part = bloom.part(size, grid.pixels(tile));
    if (blocks) {
      const auto column = [&](int x) { return std::min((x + shape.width - 1) / shape.width * shape.width, size[0]); };
      const auto row = [&](int y) { return std::min((y + shape.height - 1) / shape.height * shape.height, size[1]); };
      part = {column(part.x0), row(part.y0), column(part.x1), row(part.y1)};
    }
    all.push_back(part);
  }
  return all;
}

}  // namespace

tilecore::TexelCoding texel_coding(const GpuConfiguration& gpu) {
  return {static_cast<std::uint64_t>(gpu.memory.burst_bytes),
          gpu.frame_buffer.compression == tilecore::FrameBufferCompression::kLossless,
          gpu.frame_buffer.transaction_elimination};
}

std::uint64_t array_bytes(const GpuConfiguration& gpu, const TexelFormat& format, IntRect texels) {
  if (!texel_coding(gpu).compressed) return tilecore::pixel_count(texels) * format.texel_bytes();
  return format.block_bytes(texels) + format.block_count(texels) * tilecore::kBlockHeaderBytes;
}

// ---- One array ---------------------------------------------------------------------------------------------------------

void StoredArray::begin(const GpuConfiguration& gpu, TexelFormat format, std::vector<IntRect> pieces,
                        std::uint64_t base, std::uint64_t signatures) {
  format_ = std::move(format);
  how_ = texel_coding(gpu);
  signature_bits_ = gpu.frame_buffer.signature_bits;
  pieces_ = std::move(pieces);
  contents_.resize(pieces_.size());
  base_ = base, signatures_ = signatures;
  stored_ = true;
}

void StoredArray::forget() {
  known_ = false;
  for (Content& content : contents_) content.signature.reset();
}

StoreCounters StoredArray::keep(tilecore::StoredTexels texels, Content& content) const {
  StoreCounters work;
  content.kept = false;
  if (how_.signs) {
    work.signature_bytes = texels.signed_bytes;
    const std::uint64_t signature = tilecore::kept_bits(texels.signature, signature_bits_);
    content.kept = known_ && content.signature == signature;
    if (content.kept) {
      ++work.tiles_not_written;
      if (content.check != texels.check) ++work.wrong_matches;
      return work;
    }
    content.signature = signature, content.check = texels.check;
  }
  content.block_bytes = std::move(texels.block_bytes);
  work.pixels_compressed = texels.pixels_compressed;
  return work;
}

StoreCounters StoredArray::load(std::size_t tile) const {
  StoreCounters work;
  if (!how_.compressed) return work;
  const std::vector<std::uint16_t>& bytes = contents_[tile].block_bytes;
  std::size_t block = 0;
  for (std::size_t plane = 0; plane < format_.known_planes(); ++plane) {
    const BlockShape& shape = format_.planes[plane];
    const std::size_t end = block + format_.plane_blocks(shape, pieces_[tile]);
    for (; block < end && block < bytes.size(); ++block)
      if (bytes[block] > 0 && tilecore::compressible(shape, how_.burst_bytes))
        work.pixels_decompressed += shape.pixels();
  }
  return work;
}

std::uint64_t StoredArray::move(WorkRecorder::Round& round, const tilecore::TileOrder& order, bool write,
                                const Moves& moves) const {
  const Moves goes = [&](binner::TileIndex tile) { return moves(tile) && !(write && contents_[tile].kept); };
  const std::uint64_t moved =
      how_.compressed ? move_blocks(round, order, write, goes) : move_texels(round, order, write, goes);
  if (write && how_.signs) move_signatures(round, order, moves);
  return moved;
}

template <class Bytes>
std::uint64_t StoredArray::move_pieces(WorkRecorder::Round& round, const tilecore::TileOrder& order, TileArray array,
                                       const Bytes& bytes_of, const Moves& goes) const {
  std::uint64_t offset = 0, moved = 0;
  for (const binner::TileIndex tile : order.tiles()) {
    const std::uint64_t bytes = bytes_of(pieces_[tile]);
    if (goes(tile)) moved += round.move(tile, array, offset, bytes);
    offset += bytes;
  }
  return moved;
}

std::uint64_t StoredArray::move_texels(WorkRecorder::Round& round, const tilecore::TileOrder& order, bool write,
                                       const Moves& goes) const {
  return move_pieces(
      round, order, {write ? Unit::kResolve : Unit::kTilecore, Purpose::kAttachment, write, base_},
      [&](IntRect piece) { return tilecore::pixel_count(piece) * format_.texel_bytes(); }, goes);
}

std::uint64_t StoredArray::move_blocks(WorkRecorder::Round& round, const tilecore::TileOrder& order, bool write,
                                       const Moves& goes) const {
  TileArray blocks{write ? Unit::kResolve : Unit::kTilecore, Purpose::kAttachment, write, base_};
  std::uint64_t offset = 0, moved = 0;
  for (const binner::TileIndex tile : order.tiles()) {
    const std::vector<std::uint16_t>& bytes = contents_[tile].block_bytes;
    if (!goes(tile)) {
      offset += format_.block_bytes(pieces_[tile]);
      continue;
    }
    // A load before anything was stored reads headers alone.
    TESSERA_CHECK(!write || bytes.size() == format_.block_count(pieces_[tile]), "a piece is coded before it is stored");
    std::size_t block = 0;
    for (const BlockShape& shape : format_.planes) {
      for (const std::size_t end = block + format_.plane_blocks(shape, pieces_[tile]); block < end; ++block) {
        if (block < bytes.size()) moved += round.move(tile, blocks, offset, bytes[block]);
        offset += shape.raw_bytes();
      }
    }
  }
  return moved + move_pieces(
                     round, order, {blocks.unit, blocks.purpose, write, base_ + offset},
                     [&](IntRect piece) { return format_.block_count(piece) * tilecore::kBlockHeaderBytes; }, goes);
}

void StoredArray::move_signatures(WorkRecorder::Round& round, const tilecore::TileOrder& order,
                                  const Moves& moves) const {
  const auto bytes = static_cast<std::uint64_t>(signature_bits_ + 7) / 8;
  TileArray before{Unit::kResolve, Purpose::kSignatures, false, signatures_},
      now{Unit::kResolve, Purpose::kSignatures, true, signatures_};
  std::uint64_t offset = 0;
  for (const binner::TileIndex tile : order.tiles()) {
    if (moves(tile) && !pieces_[tile].empty()) {
      if (known_) round.move(tile, before, offset, bytes);
      round.move(tile, now, offset, bytes);
    }
    offset += bytes;
  }
}

// ---- All arrays --------------------------------------------------------------------------------------------------------

void StoredArrays::begin(const GpuConfiguration& gpu, const tilecore::TileJob& job, const Passes& passes,
                         std::uint64_t place, int colors, int frame) {
  const std::optional<int> before = std::exchange(finished_, std::nullopt);
  const std::vector<IntRect> tiles = tiles_of(*job.grid);
  const SignatureMemory signatures(job.grid->tile_count(), job.store.signature_bytes(), job.burst_bytes());
  int number = colors;
  const auto start = [&](StoredArray& array, TexelFormat format, std::vector<IntRect> pieces, std::uint64_t base) {
    array.begin(gpu, std::move(format), std::move(pieces), base, signatures.of_attachment(number++));
    if (!before || *before != frame - 1) array.forget();
  };
  const int samples = job.pattern->samples_per_pixel();
  const auto start_next = [&](StoredArray& array, const TexelFormat& format) {
    start(array, format, tiles, place);
    place += round_up(array_bytes(gpu, format, job.grid->region()), job.burst_bytes());
  };
  const bool external = job.shading.path == tilecore::ShadingPath::kGbufferExternal;
  // The light half finds places from depths; records of the exact layout name them.
  if (job.shading.path == tilecore::ShadingPath::kPrepass ||
      (external && job.shading.layout == tilecore::GbufferLayout::kPacked))
    start_next(sample_depths, tilecore::depth_format(sizeof(float), samples));
  if (external) start_next(gbuffer, tilecore::gbuffer_format(job.shading, samples));
  if (const tilecore::AttachmentActions& actions = job.actions; actions.depth_bytes > 0)
    start(depths,
          tilecore::depth_format(actions.depth_bytes / static_cast<std::uint64_t>(actions.depth_samples),
                                 actions.depth_samples),
          tiles, actions.depth_base);
  if (job.actions.velocity_bytes > 0) start(velocities, Taa::velocity_format(), tiles, job.actions.velocity_base);
  if (passes.taa != nullptr) {
    std::swap(history, history_before);
    const int first = number;
    number = first + (frame & 1);  // each of the two places has its own signatures
    start(history, Taa::history_format(), tiles, passes.taa->history.base);
    number = first + 2;
    if (!before || *before != frame - 1) history_before.forget();
    history_before.set_base(passes.taa->before_base);
  }
  if (passes.bloom == nullptr) return;
  bloom.resize(passes.bloom->levels());
  for (std::size_t level = 0; level < bloom.size(); ++level)
    start(bloom[level], passes.bloom->texel_format(),
          parts_of_level(*passes.bloom, level, *job.grid, texel_coding(gpu).compressed), passes.bloom->base(level));
}

void StoredArrays::end(int frame) {
  for (StoredArray* array : {&sample_depths, &gbuffer, &depths, &velocities, &history}) array->end();
  for (StoredArray& level : bloom) level.end();
  finished_ = frame;
}

}  // namespace tessera::gpu
