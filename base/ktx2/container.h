#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/ktx2/ktx2.h"

// The parts of the container, checked: no offset points outside of the file.
namespace tessera::ktx2 {

using FileBytes = std::span<const std::uint8_t>;

enum class Supercompression : std::uint8_t { kNone = 0, kBasisLz = 1, kZstandard = 2 };

struct ContainerLevel {
  std::uint32_t width, height;  // texels
  FileBytes data;
  std::uint64_t unpacked_bytes;  // as the file says; meaningless for BasisLZ

  std::uint32_t columns() const { return (width + 3) / 4; }
  std::uint32_t rows() const { return (height + 3) / 4; }
  std::uint64_t block_count() const { return std::uint64_t{columns()} * rows(); }
};

struct Container {
  Ktx2Header header;
  Supercompression scheme = Supercompression::kNone;
  FileBytes global_data;
  std::vector<ContainerLevel> levels;  // the largest first
};

// BasisLZ's global data: counts of the codebooks' entries, the three sections, and each level's slices (the alpha one
// empty without alpha).
struct BasisLzData {
  std::uint32_t endpoint_count = 0, selector_count = 0;
  FileBytes endpoints, selectors, tables;
  struct Slices {
    FileBytes color, alpha;
  };
  std::vector<Slices> levels;
};

// False with `fault` set; LimitError as read_ktx2_header().
[[nodiscard]] bool read_container(FileBytes bytes, const ImageLimits& limits, Container& container, std::string& fault);
[[nodiscard]] bool read_basis_lz(const Container& container, BasisLzData& data, std::string& fault);

}  // namespace tessera::ktx2
