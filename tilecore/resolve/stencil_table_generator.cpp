// Writes the packed stencils of the regular patterns as a C++ source; runs when the program is built.
//
//   tessera_stencil_table_generator OUTPUT_FILE
//
// For every kernel, pattern, set of borders and missing pixel: exact weights in double precision, normalised, then
// rounded to 8 bits such that they sum to a power of two. Rounding before normalising would lose stencils whose sum of
// weights is small, down to 0.003 where a stencil is cut at a tile's border.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "tilecore/resolve/cubic_weights.h"
#include "tilecore/resolve/packed_stencil.h"
#include "tilecore/resolve/stencil_tilt.h"
#include "tilecore/resolve/tile_border.h"

namespace tessera::tilecore {
namespace {

using ExactStencil = std::vector<ExactTap>;

bool is_rendered(BlockMask pattern, unsigned border, int x, int y) {
  if ((border & kLeftBorder && x < 0) || (border & kRightBorder && x > 3) || (border & kTopBorder && y < 0) ||
      (border & kBottomBorder && y > 3))
    return false;
  // Blocks beyond open sides have the block's closed ones, too.
  const unsigned here = (x < 0 || x > 3 ? 0u : border & (kLeftBorder | kRightBorder)) |
                        (y < 0 || y > 3 ? 0u : border & (kTopBorder | kBottomBorder));
  return (pattern | border_line(pattern, here)) >> (4 * (y & 3) + (x & 3)) & 1;
}

// Weights that are equal but for rounding compare equal.
long long comparable(double weight) { return std::llround(weight * 0x1p40); }

// Empty where no stencil holds.
ExactStencil exact_stencil(Reconstruction kernel, BlockMask pattern, unsigned border, int px, int py) {
  ExactStencil taps;
  double sum = 0, magnitude = 0;
  const int reach = kernel_reach(kernel);
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      const double w = kernel_weight(kernel, dx) * kernel_weight(kernel, dy);
      if (w == 0 || !is_rendered(pattern, border, px + dx, py + dy)) continue;
      taps.push_back({dx, dy, w});
      sum += w, magnitude += std::abs(w);
    }
  if (sum < kMinimumDenominator * magnitude) return {};
  tilt<kMaxDirectTaps>(taps);
  std::erase_if(taps, [](const ExactTap& t) { return comparable(t.weight) == 0; });
  return taps;
}

bool comes_before(const ExactTap& a, const ExactTap& b) {
  return std::tuple(a.dy, a.dx, comparable(a.weight)) < std::tuple(b.dy, b.dx, comparable(b.weight));
}

// The one of the eight symmetric forms that comes first, and the symmetry that leads back from it.
struct CanonicalStencil {
  ExactStencil taps;
  GridSymmetry back;
};
CanonicalStencil canonical(const ExactStencil& original) {
  CanonicalStencil best;
  for (std::uint8_t bits = 0; bits < 8; ++bits) {
    const GridSymmetry back{bits};
    ExactStencil form;
    // A tap of the form, brought back, must be the original's: look for it among all offsets.
    for (int dy = -kWindowMargin; dy <= kWindowMargin; ++dy)
      for (int dx = -kWindowMargin; dx <= kWindowMargin; ++dx) {
        const StencilTap there = back.apply({static_cast<std::int8_t>(dx), static_cast<std::int8_t>(dy), 0});
        for (const ExactTap& t : original)
          if (t.dx == there.dx && t.dy == there.dy) form.push_back({dx, dy, t.weight});
      }
    std::sort(form.begin(), form.end(), comes_before);
    if (best.taps.empty() ||
        std::lexicographical_compare(form.begin(), form.end(), best.taps.begin(), best.taps.end(), comes_before))
      best = {form, back};
  }
  return best;
}

// Rounds weights to multiples of 1/unit with the given sum, each within one unit of the exact weight and such that a
// ramp of one per pixel is off by one unit at most. Of all such codes the ones nearest in the sense of squares are
// taken, the moments' errors counting as a weight's. kEqual: taps of equal weight get equal codes, so that symmetric
// stencils stay symmetric and reproduce a ramp exactly; kApart: each tap is rounded up or down.
enum class Grouping { kEqual, kApart };
class Quantizer {
 public:
  Quantizer(const ExactStencil& taps, int unit, Grouping grouping)
      : taps_(taps), unit_(unit), most_(grouping == Grouping::kEqual ? 3 : 2), codes_(taps.size()) {
    for (std::size_t i = 0; i < taps.size(); ++i) {
      std::size_t g = grouping == Grouping::kEqual ? 0 : groups_.size();
      while (g < groups_.size() && comparable(taps[groups_[g].front()].weight) != comparable(taps[i].weight)) ++g;
      if (g == groups_.size()) groups_.emplace_back();
      groups_[g].push_back(i);
    }
    search(0, unit);
  }
  bool found() const { return !best_.empty(); }
  const std::vector<int>& codes() const { return best_; }

 private:
  void search(std::size_t group, int left) {
    if (group == groups_.size()) {
      if (left == 0) accept();
      return;
    }
    const double exact = taps_[groups_[group].front()].weight * unit_;
    const int first = static_cast<int>(std::floor(exact)) - (most_ > 2);
    for (int code = first; code <= exact + 1; ++code) {
      if (code < -128 || code > 127 || code < exact - 1) continue;
      for (const std::size_t i : groups_[group]) codes_[i] = code;
      search(group + 1, left - code * static_cast<int>(groups_[group].size()));
    }
  }

  void accept() {
    double error = 0, moment_x = 0, moment_y = 0;
    for (std::size_t i = 0; i < taps_.size(); ++i) {
      const double e = codes_[i] - taps_[i].weight * unit_;
      error += e * e, moment_x += e * taps_[i].dx, moment_y += e * taps_[i].dy;
    }
    if (std::max(std::abs(moment_x), std::abs(moment_y)) > 1 + 1e-9) return;
    error += moment_x * moment_x + moment_y * moment_y;
    if (best_.empty() || error < least_ - 1e-9) best_ = codes_, least_ = error;
  }

  const ExactStencil& taps_;
  int unit_, most_;
  std::vector<std::vector<std::size_t>> groups_;
  std::vector<int> codes_, best_;
  double least_ = 0;
};

struct Attempt {
  int unit;
  Grouping grouping;
};
constexpr Attempt kAttempts[] = {{256, Grouping::kEqual}, {256, Grouping::kApart}, {128, Grouping::kEqual},
                                 {128, Grouping::kApart}, {64, Grouping::kEqual},  {64, Grouping::kApart}};

Stencil quantized(const ExactStencil& taps) {
  for (const auto& [unit, grouping] : kAttempts) {
    const Quantizer quantizer(taps, unit, grouping);
    if (!quantizer.found()) continue;
    Stencil s;
    for (std::size_t i = 0; i < taps.size(); ++i) {
      const int code = quantizer.codes()[i];
      if (code == 0) continue;
      if (s.count == kMaxTaps) throw std::runtime_error("a stencil has more taps than its count can say");
      s.taps[s.count++] = {static_cast<std::int8_t>(taps[i].dx), static_cast<std::int8_t>(taps[i].dy),
                           static_cast<std::int16_t>(code)};
    }
    return s;
  }
  throw std::runtime_error("a stencil's weights cannot be rounded to a power of two");
}

constexpr Reconstruction kKernels[kTableKernels] = {Reconstruction::kCubic, Reconstruction::kCubicInterpolating,
                                                    Reconstruction::kCubicUnscaled, Reconstruction::kBilinear};

struct Tables {
  std::vector<Stencil> stencils;
  std::vector<StencilIndexEntry> index;  // [kernel][border][pattern][pixel]

  StencilIndexEntry entry(const ExactStencil& exact) {
    if (exact.empty()) return {};
    const CanonicalStencil form = canonical(exact);
    const Stencil stencil = quantized(form.taps);
    auto at = std::find(stencils.begin(), stencils.end(), stencil);
    if (at == stencils.end()) at = stencils.insert(stencils.end(), stencil);
    return {static_cast<std::uint16_t>(at - stencils.begin()), form.back};
  }

  Tables() {
    for (const Reconstruction kernel : kKernels)
      for (unsigned border = 0; border < kBorderCases; ++border)
        for (const BlockMask pattern : kTablePatterns)
          for (int p = 0; p < 16; ++p)
            index.push_back(is_rendered(pattern, border, p % 4, p / 4)
                                ? StencilIndexEntry{}
                                : entry(exact_stencil(kernel, pattern, border, p % 4, p / 4)));
  }
};

template <class Values>
void write_array(std::ostream& out, const char* declaration, const Values& values) {
  out << "inline constexpr " << declaration << " = {";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i % 24 == 0 ? "\n    " : " ") << values[i] << ",";
  out << "\n};\n\n";
}

void write_tables(const Tables& tables, std::ostream& out) {
  std::size_t bits = 0;
  std::vector<std::size_t> starts;
  for (const Stencil& s : tables.stencils) starts.push_back(bits), bits += packed_stencil_bits(s.count);
  std::vector<std::uint8_t> stream((bits + 7) / 8);
  for (std::size_t i = 0; i < starts.size(); ++i) pack_stencil(tables.stencils[i], stream, starts[i]);
  std::vector<unsigned> index;
  for (const StencilIndexEntry& e : tables.index)
    index.push_back(e.stencil == kNoStencil ? kNoStencil : e.stencil * 8u + e.symmetry.bits);

  out << "// Written by tilecore/resolve/stencil_table_generator.cpp; formats: tilecore/resolve/packed_stencil.h.\n"
      << "// " << tables.stencils.size() << " stencils in " << bits << " bits, and an index of " << index.size()
      << " entries.\n"
      << "#pragma once\n\n#include <cstdint>\n\nnamespace tessera::tilecore::generated {\n\n"
      << "inline constexpr int kStencils = " << tables.stencils.size() << ";\n"
      << "inline constexpr int kStencilBits = " << bits << ";\n\n";
  write_array(out, "std::uint8_t kPackedStencils[]", std::vector<unsigned>(stream.begin(), stream.end()));
  out << "// The first bit of each stencil.\n";
  write_array(out, "std::uint16_t kStencilStart[]", starts);
  out << "// [kernel][border][pattern][pixel]: 8 * stencil + symmetry, or 0xffff.\n";
  write_array(out, "std::uint16_t kStencilIndex[]", index);
  out << "}  // namespace tessera::tilecore::generated\n";
}

}  // namespace
}  // namespace tessera::tilecore

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: tessera_stencil_table_generator OUTPUT_FILE\n");
    return 2;
  }
  try {
    std::ofstream out(argv[1]);
    tessera::tilecore::write_tables(tessera::tilecore::Tables(), out);
    out.close();
    if (out) return 0;
    std::fprintf(stderr, "%s: cannot be written\n", argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tessera_stencil_table_generator: %s\n", error.what());
  }
  return 1;
}
