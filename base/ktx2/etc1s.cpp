#include "base/ktx2/etc1s.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/ktx2/etc2_block.h"

namespace tessera::ktx2 {
namespace {

using ByteSpan = std::span<const std::uint8_t>;

// The selectors used last, frequent ones in front. A use moves a selector to half its place; a new selector replaces
// one of the rear half, each of them in turn.
class SelectorHistory {
 public:
  explicit SelectorHistory(std::uint32_t size) : values_(size), next_(size / 2) {}

  void add(std::uint16_t value) {
    if (values_.empty()) return;
    values_[next_++] = value;
    if (next_ == values_.size()) next_ = values_.size() / 2;
  }
  std::uint16_t use(std::size_t index) {
    const std::uint16_t value = values_[index];
    std::swap(values_[index / 2], values_[index]);
    return value;
  }
  std::size_t size() const { return values_.size(); }

 private:
  std::vector<std::uint16_t> values_;
  std::size_t next_;
};

// Deltas of a channel have a code of their own for dark, middle and light values before them.
struct ColorCodes {
  std::array<HuffmanCode, 3> by_level;

  const HuffmanCode& after(std::uint8_t value) const { return by_level[value < 10 ? 0 : value < 22 ? 1 : 2]; }
};

bool next_channel(const ColorCodes& codes, BitReader& reader, std::uint8_t& value) {
  const std::uint32_t delta = codes.after(value).decode(reader);
  value = static_cast<std::uint8_t>((value + delta) & 31u);
  return delta != HuffmanCode::kNone;
}

bool read_endpoints(std::uint32_t count, ByteSpan section, std::vector<Etc1sEndpoint>& endpoints, std::string& fault) {
  BitReader reader(section);
  ColorCodes colors;
  HuffmanCode tables;
  for (HuffmanCode& code : colors.by_level)
    if (!code.read(reader, fault)) return false;
  if (!tables.read(reader, fault)) return false;
  const bool grey = reader.bits(1) != 0;
  Etc1sEndpoint before{16, 16, 16, 0};
  endpoints.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t delta = tables.decode(reader);
    before.table = static_cast<std::uint8_t>((before.table + delta) & 7u);
    bool sound = delta != HuffmanCode::kNone && next_channel(colors, reader, before.red);
    if (grey)
      before.green = before.blue = before.red;
    else
      sound = sound && next_channel(colors, reader, before.green) && next_channel(colors, reader, before.blue);
    if (!sound || reader.overrun()) return fault = fmt::format("the endpoint codebook ends at entry {}", i), false;
    endpoints.push_back(before);
  }
  return true;
}

bool read_selectors(std::uint32_t count, ByteSpan section, std::vector<Etc1sSelector>& selectors, std::string& fault) {
  BitReader reader(section);
  if (reader.bits(2) != 0) return fault = "the selector codebook is of an unknown kind", false;
  const bool raw = reader.bits(1) != 0;
  HuffmanCode deltas;
  if (!raw && !deltas.read(reader, fault)) return false;
  Etc1sSelector before{};
  selectors.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    bool sound = true;
    for (std::uint8_t& row : before.rows) {
      const std::uint32_t value = raw || i == 0 ? reader.bits(8) : deltas.decode(reader);
      sound = sound && value < 256;
      row = static_cast<std::uint8_t>(raw || i == 0 ? value : row ^ value);
    }
    if (!sound || reader.overrun()) return fault = fmt::format("the selector codebook ends at entry {}", i), false;
    selectors.push_back(before);
  }
  return true;
}

// Numbers in groups of `group` bits, low ones first, each group behind it a bit that says whether another follows.
// False where there are more than 32 bits.
bool read_groups(BitReader& reader, unsigned group, std::uint32_t& value) {
  std::uint64_t sum = 0;
  for (unsigned at = 0; at < 32; at += group) {
    const std::uint32_t bits = reader.bits(group + 1);
    sum |= static_cast<std::uint64_t>(bits & ((1u << group) - 1)) << at;
    if ((bits >> group) == 0) {
      value = static_cast<std::uint32_t>(sum);
      return sum <= 0xFFFFFFFFu;
    }
  }
  return false;
}

// The state of one slice as its blocks are read.
class SliceReader {
 public:
  SliceReader(const Etc1sCodebooks& books, ByteSpan slice, std::uint32_t columns)
      : books_(books), reader_(slice), history_(books.history_size), lower_(columns / 2 + 1), above_(columns) {}

  // False where the block is damaged.
  bool next(std::uint32_t x, std::uint32_t y, Etc1sBlock& block) {
    if (x % 2 == 0 && !next_predictions(x, y)) return false;
    const unsigned prediction = predictions_ & 3u;
    predictions_ >>= 2;
    if (!next_endpoint(prediction, x, y) || !next_selector(block.selector)) return false;
    block.endpoint = endpoint_;
    return !reader_.overrun();
  }

 private:
  // The source of a block's endpoint.
  enum Prediction : unsigned { kLeft, kAbove, kAboveLeft, kDelta };
  // The symbol after the 256 predictions of 2x2 blocks: it repeats the previous prediction several times.
  static constexpr std::uint32_t kRepeat = 256, kMinRepeats = 3;
  static constexpr std::uint32_t kMinRun = 3, kLongRun = 63;

  // The predictions of 2x2 blocks, 2 bits each, are read at the upper left block; the lower row's predictions are
  // stored until then.
  bool next_predictions(std::uint32_t x, std::uint32_t y) {
    if (y % 2 == 1) {
      predictions_ = lower_[x / 2];
      return true;
    }
    if (repeats_ > 0) {
      --repeats_;
    } else {
      const std::uint32_t symbol = books_.predictions.decode(reader_);
      if (symbol > kRepeat) return false;
      if (symbol < kRepeat) {
        last_predictions_ = symbol;
      } else {
        std::uint32_t more = 0;
        if (!read_groups(reader_, 4, more)) return false;
        repeats_ = std::uint64_t{more} + kMinRepeats - 1;
      }
    }
    predictions_ = last_predictions_;
    lower_[x / 2] = static_cast<std::uint8_t>(predictions_ >> 4);
    return true;
  }

  bool next_endpoint(unsigned prediction, std::uint32_t x, std::uint32_t y) {
    // above_ holds this row up to x - 1 and the row above from x on; above_left_ is the value that x - 1 replaced.
    const std::uint16_t above = above_[x];
    if (prediction == kLeft) {
      if (x == 0) return false;
    } else if (prediction == kAbove) {
      if (y == 0) return false;
      endpoint_ = above;
    } else if (prediction == kAboveLeft) {
      if (x == 0 || y == 0) return false;
      endpoint_ = above_left_;
    } else {
      const std::uint32_t delta = books_.endpoint_deltas.decode(reader_);
      if (delta >= books_.endpoints.size()) return false;
      const std::size_t sum = endpoint_ + std::size_t{delta};
      endpoint_ = static_cast<std::uint16_t>(sum < books_.endpoints.size() ? sum : sum - books_.endpoints.size());
    }
    above_left_ = above;
    above_[x] = endpoint_;
    return true;
  }

  bool next_selector(std::uint16_t& selector) {
    const auto count = static_cast<std::uint32_t>(books_.selectors.size());
    std::uint32_t symbol = count;
    if (run_ > 0) {
      --run_;
    } else {
      symbol = books_.selector_symbols.decode(reader_);
      if (symbol == count + books_.history_size) {
        const std::uint32_t length = books_.selector_runs.decode(reader_);
        std::uint32_t more = length;
        if (length > kLongRun || (length == kLongRun && !read_groups(reader_, 7, more))) return false;
        run_ = std::uint64_t{more} + kMinRun - 1;
        symbol = count;
      }
    }
    if (symbol < count) {
      selector = static_cast<std::uint16_t>(symbol);
      history_.add(selector);
      return true;
    }
    if (symbol - count >= books_.history_size) return false;
    selector = history_.use(symbol - count);
    return true;
  }

  const Etc1sCodebooks& books_;
  BitReader reader_;
  SelectorHistory history_;
  std::vector<std::uint8_t> lower_;
  std::vector<std::uint16_t> above_;
  std::uint16_t above_left_ = 0, endpoint_ = 0;
  std::uint32_t predictions_ = 0, last_predictions_ = 0;
  std::uint64_t repeats_ = 0, run_ = 0;
};

}  // namespace

bool read_etc1s_codebooks(std::uint32_t endpoint_count, ByteSpan endpoint_section, std::uint32_t selector_count,
                          ByteSpan selector_section, ByteSpan table_section, Etc1sCodebooks& books,
                          std::string& fault) {
  if (!read_endpoints(endpoint_count, endpoint_section, books.endpoints, fault) ||
      !read_selectors(selector_count, selector_section, books.selectors, fault))
    return false;
  BitReader reader(table_section);
  for (HuffmanCode* code : {&books.predictions, &books.endpoint_deltas, &books.selector_symbols, &books.selector_runs})
    if (!code->read(reader, fault)) return false;
  books.history_size = reader.bits(13);
  if (reader.overrun()) return fault = "the Huffman tables of slices end early", false;
  return true;
}

bool read_etc1s_slice(const Etc1sCodebooks& books, ByteSpan slice, std::uint32_t columns, std::uint32_t rows,
                      std::span<Etc1sBlock> blocks, std::string& fault) {
  SliceReader reader(books, slice, columns);
  std::size_t at = 0;
  for (std::uint32_t y = 0; y < rows; ++y)
    for (std::uint32_t x = 0; x < columns; ++x)
      if (!reader.next(x, y, blocks[at++])) return fault = fmt::format("a slice is damaged at block {}", at - 1), false;
  return true;
}

std::array<std::array<std::uint8_t, 3>, 4> etc1s_colors(const Etc1sEndpoint& endpoint) {
  const auto [a, b] = kEtc1Modifiers[endpoint.table];
  const std::array<int, 4> steps = {-b, -a, a, b};
  std::array<std::array<std::uint8_t, 3>, 4> colors{};
  const std::array<int, 3> base = {endpoint.red, endpoint.green, endpoint.blue};
  for (std::size_t s = 0; s < 4; ++s)
    for (std::size_t c = 0; c < 3; ++c)
      colors[s][c] = static_cast<std::uint8_t>(std::clamp(widen_bits(base[c], 5) + steps[s], 0, 255));
  return colors;
}

}  // namespace tessera::ktx2
