#include "base/ktx2/huffman.h"

#include <fmt/format.h>

namespace tessera::ktx2 {
namespace {

// Symbols of the code that packs the lengths: 0 to 16 are lengths, the others repeat.
constexpr std::uint32_t kShortZeros = 17, kLongZeros = 18, kShortRepeat = 19;

struct Run {
  std::uint32_t count;
  std::uint8_t length;
};

// Expands a repeating symbol: 3 to 10 or 11 to 138 zeros, 3 to 6 or 7 to 134 times the previous length.
Run length_run(std::uint32_t symbol, std::uint8_t before, BitReader& reader) {
  if (symbol == kShortZeros) return {3 + reader.bits(3), 0};
  if (symbol == kLongZeros) return {11 + reader.bits(7), 0};
  if (symbol == kShortRepeat) return {3 + reader.bits(2), before};
  return {7 + reader.bits(7), before};
}

}  // namespace

bool HuffmanCode::build(const std::vector<std::uint8_t>& lengths) {
  count_.fill(0);
  symbols_.clear();
  if (lengths.size() > kMaxSymbols) return false;
  std::uint32_t used = 0;
  for (const std::uint8_t length : lengths) {
    if (length > kMaxLength) return false;
    if (length == 0) continue;
    ++count_[length];
    ++used;
  }
  // Complete: the codes' shares of all bit strings sum to one.
  std::uint64_t share = 0;
  for (unsigned length = 1; length <= kMaxLength; ++length)
    share += static_cast<std::uint64_t>(count_[length]) << (kMaxLength - length);
  constexpr std::uint64_t kWhole = std::uint64_t{1} << kMaxLength;
  if (used > 1 && share != kWhole) return false;

  std::array<std::uint32_t, kMaxLength + 2> place{};
  for (unsigned length = 1; length <= kMaxLength; ++length) place[length + 1] = place[length] + count_[length];
  symbols_.resize(used);
  for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol)
    if (lengths[symbol] != 0) symbols_[place[lengths[symbol]]++] = static_cast<std::uint16_t>(symbol);
  return true;
}

bool HuffmanCode::read(BitReader& reader, std::string& fault) {
  const std::uint32_t total = reader.bits(14);
  const std::uint32_t stored = reader.bits(5);
  std::vector<std::uint8_t> lengths(kHuffmanLengthOrder.size());
  HuffmanCode packing;
  if (stored > kHuffmanLengthOrder.size())
    return fault = fmt::format("a Huffman table has {} lengths of lengths", stored), false;
  for (std::uint32_t i = 0; i < stored; ++i)
    lengths[kHuffmanLengthOrder[i]] = static_cast<std::uint8_t>(reader.bits(3));
  if (!packing.build(lengths)) return fault = "the lengths of a Huffman table are no code", false;

  lengths.assign(total, 0);
  for (std::uint32_t at = 0; at < total;) {
    const std::uint32_t symbol = packing.decode(reader);
    if (symbol == kNone || reader.overrun()) return fault = "a Huffman table ends early", false;
    if (symbol <= kMaxLength) {
      lengths[at++] = static_cast<std::uint8_t>(symbol);
      continue;
    }
    const std::uint8_t before = at == 0 ? std::uint8_t{0} : lengths[at - 1];
    if (symbol >= kShortRepeat && before == 0) return fault = "a Huffman table repeats no length", false;
    const Run run = length_run(symbol, before, reader);
    if (run.count > total - at) return fault = "a Huffman table has more lengths than symbols", false;
    for (std::uint32_t i = 0; i < run.count; ++i) lengths[at++] = run.length;
  }
  if (!build(lengths)) return fault = "a Huffman table is no code", false;
  return true;
}

std::uint32_t HuffmanCode::decode(BitReader& reader) const {
  // Codes of one length are consecutive numbers, the first of them twice the number that follows the codes before.
  std::uint32_t code = 0, first = 0, place = 0;
  for (unsigned length = 1; length <= kMaxLength; ++length) {
    code = code * 2 + reader.bits(1);
    first *= 2;
    if (code - first < count_[length]) return symbols_[place + code - first];
    first += count_[length];
    place += count_[length];
    if (place == symbols_.size()) break;
  }
  return kNone;
}

}  // namespace tessera::ktx2
