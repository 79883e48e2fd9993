#include "base/ktx2/etc1s_encoder.h"

#include <algorithm>

#include "base/ktx2/bit_writer.h"
#include "base/ktx2/etc1s_fit.h"
#include "base/ktx2/huffman_encoder.h"
#include "base/ktx2/level_blocks.h"
#include "base/ktx2/selector_history.h"

namespace tessera::ktx2 {
namespace {

constexpr std::uint32_t kHistorySize = 64;  // [assumed] as the reference encoder's

// ---- Codebooks --------------------------------------------------------------------------------------------------

std::size_t level_of(std::uint8_t value) { return value < 10 ? 0 : value < 22 ? 1 : 2; }

std::string endpoint_section(const std::vector<Etc1sEndpoint>& endpoints) {
  const bool grey = std::all_of(endpoints.begin(), endpoints.end(),
                                [](const Etc1sEndpoint& e) { return e.red == e.green && e.red == e.blue; });
  // Visits the deltas in the order of the stream: color(code of the value before, delta), table(delta).
  const auto visit = [&](const auto& table, const auto& color) {
    Etc1sEndpoint before{16, 16, 16, 0};
    for (const Etc1sEndpoint& e : endpoints) {
      table((e.table - before.table) & 7u);
      color(level_of(before.red), (e.red - before.red) & 31u);
      if (!grey) {
        color(level_of(before.green), (e.green - before.green) & 31u);
        color(level_of(before.blue), (e.blue - before.blue) & 31u);
      }
      before = e;
    }
  };
  std::array<std::vector<std::uint64_t>, 3> color_counts;
  for (std::vector<std::uint64_t>& counts : color_counts) counts.resize(32);
  std::vector<std::uint64_t> table_counts(8);
  visit([&](unsigned delta) { ++table_counts[delta]; },
        [&](std::size_t level, unsigned delta) { ++color_counts[level][delta]; });
  const std::array<HuffmanEncoder, 3> colors = {HuffmanEncoder(color_counts[0]), HuffmanEncoder(color_counts[1]),
                                                HuffmanEncoder(color_counts[2])};
  const HuffmanEncoder tables(table_counts);
  BitWriter writer;
  for (const HuffmanEncoder& code : colors) code.write_table(writer);
  tables.write_table(writer);
  writer.bits(grey ? 1 : 0, 1);
  visit([&](unsigned delta) { tables.write(delta, writer); },
        [&](std::size_t level, unsigned delta) { colors[level].write(delta, writer); });
  return writer.take();
}

std::string selector_section(const std::vector<Etc1sSelector>& selectors) {
  std::vector<std::uint64_t> counts(256);
  for (std::size_t i = 1; i < selectors.size(); ++i)
    for (std::size_t row = 0; row < 4; ++row) ++counts[selectors[i].rows[row] ^ selectors[i - 1].rows[row]];
  const HuffmanEncoder deltas(counts);
  BitWriter writer;
  writer.bits(0, 3);  // neither a global nor a hybrid codebook, and not raw
  deltas.write_table(writer);
  for (std::size_t i = 0; i < selectors.size(); ++i)
    for (std::size_t row = 0; row < 4; ++row)
      if (i == 0)
        writer.bits(selectors[i].rows[row], 8);
      else
        deltas.write(selectors[i].rows[row] ^ selectors[i - 1].rows[row], writer);
  return writer.take();
}

// ---- Slices -----------------------------------------------------------------------------------------------------

// One symbol of a slice: of which code, and bits behind it: `groups` > 0: numbers in groups of so many bits.
enum class Code : std::uint8_t { kPredictions, kEndpointDeltas, kSelectorSymbols, kSelectorRuns };
struct SliceSymbol {
  Code code;
  std::uint32_t symbol;
  unsigned groups = 0;
  std::uint32_t more = 0;
};

// What a slice is made of, in the order of the stream.
class SliceSymbols {
 public:
  SliceSymbols(std::span<const Etc1sBlock> blocks, std::size_t columns, std::size_t rows, std::size_t endpoint_count,
               std::size_t selector_count)
      : blocks_(blocks),
        columns_(columns),
        rows_(rows),
        endpoint_count_(static_cast<std::uint32_t>(endpoint_count)),
        selector_count_(static_cast<std::uint32_t>(selector_count)) {
    for (std::size_t y = 0; y < rows; ++y)
      for (std::size_t x = 0; x < columns; ++x) {
        if (x % 2 == 0 && y % 2 == 0) add_predictions(x, y);
        add_endpoint(x, y);
        add_selector(y * columns + x);
      }
  }

  std::vector<SliceSymbol> take() { return std::move(symbols_); }

 private:
  enum Prediction : unsigned { kLeft, kAbove, kAboveLeft, kDelta };
  static constexpr std::uint32_t kRepeat = 256, kMinRepeats = 3, kMinRun = 3, kLongRun = 63;

  unsigned prediction(std::size_t x, std::size_t y) const {
    if (x >= columns_ || y >= rows_) return kLeft;
    const auto at = [&](std::size_t dx, std::size_t dy) { return blocks_[(y - dy) * columns_ + x - dx].endpoint; };
    const std::uint16_t own = at(0, 0);
    if (x > 0 && at(1, 0) == own) return kLeft;
    if (y > 0 && at(0, 1) == own) return kAbove;
    return x > 0 && y > 0 && at(1, 1) == own ? kAboveLeft : kDelta;
  }
  std::uint32_t predictions(std::size_t x, std::size_t y) const {
    return prediction(x, y) | prediction(x + 1, y) << 2 | prediction(x, y + 1) << 4 | prediction(x + 1, y + 1) << 6;
  }

  // Those of 2x2 blocks; the same as before, at least three times, as one symbol.
  void add_predictions(std::size_t x, std::size_t y) {
    if (repeats_ > 0) {
      --repeats_;
      return;
    }
    const std::uint32_t symbol = predictions(x, y);
    std::uint32_t run = 0;
    if (symbol == last_predictions_) {
      for (std::size_t nx = x, ny = y; ny < rows_ && predictions(nx, ny) == symbol; ++run)
        if (nx += 2; nx >= columns_) nx = 0, ny += 2;
    }
    if (run >= kMinRepeats) {
      symbols_.push_back({Code::kPredictions, kRepeat, 4, run - kMinRepeats});
      repeats_ = run - 1;
    } else {
      symbols_.push_back({Code::kPredictions, symbol});
    }
    last_predictions_ = symbol;
  }

  void add_endpoint(std::size_t x, std::size_t y) {
    const std::uint32_t own = blocks_[y * columns_ + x].endpoint;
    if (prediction(x, y) == kDelta)
      symbols_.push_back(
          {Code::kEndpointDeltas, own >= endpoint_ ? own - endpoint_ : own + endpoint_count_ - endpoint_});
    endpoint_ = own;
  }

  void add_selector(std::size_t index) {
    if (run_ > 0) {
      --run_;
      return;
    }
    const std::uint16_t own = blocks_[index].selector;
    const std::size_t place = history_.find(own);
    if (place == history_.size()) {
      symbols_.push_back({Code::kSelectorSymbols, own});
      history_.add(own);
      return;
    }
    if (place == 0) {
      std::uint32_t run = 0;
      for (std::size_t i = index; i < blocks_.size() && blocks_[i].selector == own; ++i) ++run;
      if (run >= kMinRun) {
        symbols_.push_back({Code::kSelectorSymbols, selector_count_ + kHistorySize});
        if (run - kMinRun < kLongRun)
          symbols_.push_back({Code::kSelectorRuns, run - kMinRun});
        else
          symbols_.push_back({Code::kSelectorRuns, kLongRun, 7, run - kMinRun});
        run_ = run - 1;
        return;
      }
    }
    symbols_.push_back({Code::kSelectorSymbols, selector_count_ + static_cast<std::uint32_t>(place)});
    history_.use(place);
  }

  std::span<const Etc1sBlock> blocks_;
  std::size_t columns_, rows_;
  std::uint32_t endpoint_count_, selector_count_;
  SelectorHistory history_{kHistorySize};
  std::vector<SliceSymbol> symbols_;
  std::uint32_t endpoint_ = 0, last_predictions_ = 0, repeats_ = 0, run_ = 0;
};

struct SliceCodes {
  std::array<HuffmanEncoder, 4> by_code;
};

SliceCodes codes_for(const std::vector<std::vector<SliceSymbol>>& slices, std::size_t endpoint_count,
                     std::size_t selector_count) {
  std::array<std::vector<std::uint64_t>, 4> counts;
  counts[0].resize(257);
  counts[1].resize(endpoint_count);
  counts[2].resize(selector_count + kHistorySize + 1);
  counts[3].resize(64);
  for (const std::vector<SliceSymbol>& slice : slices)
    for (const SliceSymbol& symbol : slice) ++counts[static_cast<std::size_t>(symbol.code)][symbol.symbol];
  return {{HuffmanEncoder(counts[0]), HuffmanEncoder(counts[1]), HuffmanEncoder(counts[2]), HuffmanEncoder(counts[3])}};
}

std::string table_section(const SliceCodes& codes) {
  BitWriter writer;
  for (const HuffmanEncoder& code : codes.by_code) code.write_table(writer);
  writer.bits(kHistorySize, 13);
  return writer.take();
}

// Low groups first, each with a bit behind it that says whether another follows.
void write_groups(std::uint32_t value, unsigned group, BitWriter& writer) {
  do {
    writer.bits(value & ((1u << group) - 1), group);
    value >>= group;
    writer.bits(value != 0 ? 1 : 0, 1);
  } while (value != 0);
}

std::string slice_bytes(const std::vector<SliceSymbol>& symbols, const SliceCodes& codes) {
  BitWriter writer;
  for (const SliceSymbol& symbol : symbols) {
    codes.by_code[static_cast<std::size_t>(symbol.code)].write(symbol.symbol, writer);
    if (symbol.groups > 0) write_groups(symbol.more, symbol.groups, writer);
  }
  return writer.take();
}

}  // namespace

BasisLzFile encode_basis_lz(std::span<const LevelToWrite> levels, bool alpha) {
  // Blocks of all slices in their order in the file: colour and alpha, level by level.
  std::vector<TexelBlock> texels;
  std::vector<std::size_t> ends;
  for (const LevelToWrite& level : levels)
    for (int slice = 0; slice < (alpha ? 2 : 1); ++slice) {
      for (TexelBlock block : level_blocks(level)) {
        for (auto& texel : block) {
          if (slice == 1) texel = {texel[3], texel[3], texel[3], 255};
          texel[3] = 255;
        }
        texels.push_back(block);
      }
      ends.push_back(texels.size());
    }
  const Etc1sFit fit = fit_etc1s(texels);
  const std::size_t slices_a_level = alpha ? 2 : 1;
  std::vector<std::vector<SliceSymbol>> symbols;
  for (std::size_t s = 0; s < ends.size(); ++s) {
    const LevelToWrite& level = levels[s / slices_a_level];
    const std::size_t first = s == 0 ? 0 : ends[s - 1];
    symbols.push_back(SliceSymbols(std::span(fit.blocks).subspan(first, ends[s] - first), block_columns(level),
                                   block_rows(level), fit.endpoints.size(), fit.selectors.size())
                          .take());
  }
  const SliceCodes codes = codes_for(symbols, fit.endpoints.size(), fit.selectors.size());
  BasisLzFile out;
  const std::string endpoints = endpoint_section(fit.endpoints), selectors = selector_section(fit.selectors),
                    tables = table_section(codes);
  put_number(out.global_data, fit.endpoints.size(), 2);
  put_number(out.global_data, fit.selectors.size(), 2);
  for (const std::size_t size : {endpoints.size(), selectors.size(), tables.size(), std::size_t{0}})
    put_number(out.global_data, size, 4);
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const std::string color = slice_bytes(symbols[l * slices_a_level], codes),
                      opacity = alpha ? slice_bytes(symbols[l * slices_a_level + 1], codes) : std::string();
    put_number(out.global_data, 0, 4);  // no flags
    put_number(out.global_data, 0, 4);
    put_number(out.global_data, color.size(), 4);
    put_number(out.global_data, alpha ? color.size() : 0, 4);
    put_number(out.global_data, opacity.size(), 4);
    out.levels.push_back(color + opacity);
  }
  out.global_data += endpoints + selectors + tables;
  return out;
}

}  // namespace tessera::ktx2
