#include "base/ktx2/huffman_encoder.h"

#include <algorithm>
#include <array>
#include <queue>

#include "base/ktx2/huffman.h"

namespace tessera::ktx2 {
namespace {

// Lengths of a Huffman code (Huffman 1952). Where some are longer than `most` counts are made more alike, until none is:
// with all of them alike no length exceeds that of a symbol's number.
std::vector<std::uint8_t> code_lengths(std::vector<std::uint64_t> counts, unsigned most) {
  struct Node {
    std::uint64_t count;
    std::size_t number;  // symbols first, then inner nodes as they are made
    bool operator>(const Node& o) const { return count != o.count ? count > o.count : number > o.number; }
  };
  for (;;) {
    std::priority_queue<Node, std::vector<Node>, std::greater<>> open;
    for (std::size_t s = 0; s < counts.size(); ++s)
      if (counts[s] > 0) open.push({counts[s], s});
    std::vector<std::uint8_t> lengths(counts.size(), 0);
    if (open.size() == 1) {
      lengths[open.top().number] = 1;
      return lengths;
    }
    std::vector<std::array<std::size_t, 2>> inner;
    while (open.size() > 1) {
      const Node a = open.top();
      open.pop();
      const Node b = open.top();
      open.pop();
      open.push({a.count + b.count, counts.size() + inner.size()});
      inner.push_back({a.number, b.number});
    }
    // Depths from the root down; children have lower numbers than what holds them.
    std::vector<unsigned> depth(counts.size() + inner.size(), 0);
    unsigned deepest = 0;
    for (std::size_t i = inner.size(); i-- > 0;)
      for (const std::size_t child : inner[i]) {
        depth[child] = depth[counts.size() + i] + 1;
        deepest = std::max(deepest, depth[child]);
      }
    if (deepest <= most) {
      for (std::size_t s = 0; s < counts.size(); ++s) lengths[s] = static_cast<std::uint8_t>(depth[s]);
      return lengths;
    }
    for (std::uint64_t& count : counts)
      if (count > 0) count = count / 2 + 1;
  }
}

// Canonical codes of lengths (RFC 1951, 3.2.2), bits reversed.
std::vector<std::uint16_t> codes_of(const std::vector<std::uint8_t>& lengths) {
  std::array<std::uint32_t, HuffmanCode::kMaxLength + 2> next{};
  for (const std::uint8_t length : lengths)
    if (length > 0) ++next[length + 1u];
  for (unsigned length = 1; length < next.size(); ++length) next[length] = (next[length] + next[length - 1]) << 1;
  std::vector<std::uint16_t> codes(lengths.size(), 0);
  for (std::size_t s = 0; s < lengths.size(); ++s) {
    if (lengths[s] == 0) continue;
    const std::uint32_t code = next[lengths[s]]++;
    std::uint32_t reversed = 0;
    for (unsigned bit = 0; bit < lengths[s]; ++bit) reversed |= ((code >> bit) & 1u) << (lengths[s] - 1u - bit);
    codes[s] = static_cast<std::uint16_t>(reversed);
  }
  return codes;
}

// A length, or a run of them: symbol, bits behind it and how many.
struct LengthSymbol {
  std::uint32_t symbol, extra;
  unsigned extra_bits;
};

// Runs as HuffmanCode::read() knows them: 17 and 18 zeros, 19 and 20 the length before again.
std::vector<LengthSymbol> packed_lengths(const std::vector<std::uint8_t>& lengths) {
  std::vector<LengthSymbol> out;
  for (std::size_t at = 0; at < lengths.size();) {
    std::size_t end = at + 1;
    while (end < lengths.size() && lengths[end] == lengths[at]) ++end;
    auto left = static_cast<std::uint32_t>(end - at);
    const std::uint32_t length = lengths[at];
    if (length != 0) {
      out.push_back({length, 0, 0});
      --left;
    }
    while (left >= 3) {
      const bool longer = left >= (length == 0 ? 11u : 7u);
      const std::uint32_t least = longer ? (length == 0 ? 11u : 7u) : 3u;
      const unsigned bits = longer ? 7u : length == 0 ? 3u : 2u;
      const std::uint32_t taken = std::min(left, least + (1u << bits) - 1);
      out.push_back({(length == 0 ? 17u : 19u) + (longer ? 1u : 0u), taken - least, bits});
      left -= taken;
    }
    for (; left > 0; --left) out.push_back({length, 0, 0});
    at = end;
  }
  return out;
}

}  // namespace

HuffmanEncoder::HuffmanEncoder(std::vector<std::uint64_t> counts) {
  if (counts.empty()) counts.resize(1);
  if (std::all_of(counts.begin(), counts.end(), [](std::uint64_t count) { return count == 0; })) counts[0] = 1;
  lengths_ = code_lengths(std::move(counts), HuffmanCode::kMaxLength);
  codes_ = codes_of(lengths_);
}

void HuffmanEncoder::write_table(BitWriter& writer) const {
  std::vector<std::uint8_t> used = lengths_;
  while (used.back() == 0) used.pop_back();
  const std::vector<LengthSymbol> packed = packed_lengths(used);
  std::vector<std::uint64_t> counts(kHuffmanLengthOrder.size(), 0);
  for (const LengthSymbol& symbol : packed) ++counts[symbol.symbol];
  constexpr unsigned kMaxLengthOfLengths = 7;
  const std::vector<std::uint8_t> lengths = code_lengths(counts, kMaxLengthOfLengths);
  const std::vector<std::uint16_t> codes = codes_of(lengths);
  writer.bits(static_cast<std::uint32_t>(used.size()), 14);
  std::size_t stored = kHuffmanLengthOrder.size();
  while (lengths[kHuffmanLengthOrder[stored - 1]] == 0) --stored;
  writer.bits(static_cast<std::uint32_t>(stored), 5);
  for (std::size_t i = 0; i < stored; ++i) writer.bits(lengths[kHuffmanLengthOrder[i]], 3);
  for (const LengthSymbol& symbol : packed) {
    writer.bits(codes[symbol.symbol], lengths[symbol.symbol]);
    writer.bits(symbol.extra, symbol.extra_bits);
  }
}

void HuffmanEncoder::write(std::uint32_t symbol, BitWriter& writer) const {
  writer.bits(codes_[symbol], lengths_[symbol]);
}

}  // namespace tessera::ktx2
