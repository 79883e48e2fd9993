#include "base/ktx2/container.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::ktx2 {
namespace {

constexpr std::array<std::uint8_t, 12> kIdentifier = {0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};

// Offsets of the header's fields and sizes of its parts (KTX 2.0, section 3).
constexpr std::size_t kFormatAt = 12, kWidthAt = 20, kHeightAt = 24, kDepthAt = 28, kLayersAt = 32, kFacesAt = 36,
                      kLevelsAt = 40, kSchemeAt = 44, kDescriptorAt = 48, kKeyValuesAt = 56, kGlobalDataAt = 64,
                      kIndexAt = 80, kIndexEntryBytes = 24;

// Colour models and channels of Basis Universal, transfer functions (Khronos Data Format 1.3, section 5).
constexpr std::uint32_t kModelEtc1s = 163, kModelUastc = 166;
constexpr std::uint32_t kChannelRgb = 0, kEtc1sRed = 3, kChannelEtc1sAlpha = 15, kChannelUastcRgba = 3, kUastcRed = 4;
constexpr std::uint32_t kTransferLinear = 1, kTransferSrgb = 2;
constexpr std::size_t kDescriptorHeadBytes = 24, kDescriptorSampleBytes = 16;

std::uint32_t word16(FileBytes bytes, std::size_t at) { return bytes[at] | (std::uint32_t{bytes[at + 1]} << 8); }
std::uint32_t word32(FileBytes bytes, std::size_t at) { return word16(bytes, at) | (word16(bytes, at + 2) << 16); }
std::uint64_t word64(FileBytes bytes, std::size_t at) {
  return word32(bytes, at) | (std::uint64_t{word32(bytes, at + 4)} << 32);
}

// Part of a file. False where it reaches beyond.
bool part_of(FileBytes bytes, std::uint64_t at, std::uint64_t length, FileBytes& part) {
  if (at > bytes.size() || length > bytes.size() - at) return false;
  part = bytes.subspan(static_cast<std::size_t>(at), static_cast<std::size_t>(length));
  return true;
}

// Sides and number of levels.
bool read_sizes(FileBytes bytes, const ImageLimits& limits, Container& container, std::string& fault) {
  const std::uint32_t width = word32(bytes, kWidthAt), height = word32(bytes, kHeightAt);
  const std::uint32_t levels = std::max(word32(bytes, kLevelsAt), 1u);
  if (word32(bytes, kFormatAt) != 0) return fault = "KTX2 file has no Basis Universal data", false;
  if (width == 0 || height == 0 || word32(bytes, kDepthAt) != 0 || word32(bytes, kLayersAt) != 0 ||
      word32(bytes, kFacesAt) != 1)
    return fault = "KTX2 file holds no two-dimensional texture", false;
  const auto max_side = static_cast<std::uint32_t>(std::max(limits.max_side, 0));
  if (width > max_side || height > max_side || std::uint64_t{width} * height > limits.max_pixels)
    throw LimitError(fmt::format("image of {}x{} pixels exceeds the limit of {} a side and {} in all", width, height,
                                 limits.max_side, limits.max_pixels));
  const auto most = static_cast<std::uint32_t>(std::bit_width(std::max(width, height)));
  if (levels > most)
    return fault = fmt::format("KTX2 file has {} levels of {}x{} texels, at most {} are possible", levels, width,
                               height, most),
           false;
  container.header.width = static_cast<int>(width);
  container.header.height = static_cast<int>(height);
  container.header.levels = static_cast<int>(levels);
  return true;
}

bool read_index(FileBytes bytes, Container& container, std::string& fault) {
  const auto levels = static_cast<std::size_t>(container.header.levels);
  if (bytes.size() < kIndexAt + kIndexEntryBytes * levels) return fault = "KTX2 file ends in its level index", false;
  for (std::size_t i = 0; i < levels; ++i) {
    const std::size_t entry = kIndexAt + kIndexEntryBytes * i;
    ContainerLevel level{std::max(static_cast<std::uint32_t>(container.header.width) >> i, 1u),
                         std::max(static_cast<std::uint32_t>(container.header.height) >> i, 1u),
                         {},
                         word64(bytes, entry + 16)};
    if (!part_of(bytes, word64(bytes, entry), word64(bytes, entry + 8), level.data))
      return fault = fmt::format("level {} of a KTX2 file reaches beyond its end", i), false;
    container.levels.push_back(level);
  }
  return true;
}

// Checks the channels of the samples and finds out whether alpha is among them.
bool read_channels(bool etc1s, std::size_t samples, FileBytes block, bool& alpha) {
  const auto channel = [&](std::size_t sample) {
    return block[kDescriptorHeadBytes + kDescriptorSampleBytes * sample + 3] & 15u;
  };
  if (samples == 0) return false;
  if (etc1s) {
    alpha = samples == 2 && channel(0) == kChannelRgb && channel(1) == kChannelEtc1sAlpha;
    return alpha || (samples == 1 && (channel(0) == kChannelRgb || channel(0) == kEtc1sRed));
  }
  alpha = channel(0) == kChannelUastcRgba;
  return samples == 1 && (alpha || channel(0) == kChannelRgb || channel(0) == kUastcRed);
}

// The basic block of the data format descriptor.
bool read_descriptor(FileBytes bytes, Container& container, std::string& fault) {
  FileBytes descriptor;
  if (!part_of(bytes, word32(bytes, kDescriptorAt), word32(bytes, kDescriptorAt + 4), descriptor) ||
      descriptor.size() < 4 + kDescriptorHeadBytes || word32(descriptor, 0) != descriptor.size())
    return fault = "KTX2 file has no sound data format descriptor", false;
  const FileBytes block = descriptor.subspan(4);
  const std::size_t block_bytes = word16(block, 6);
  if (word32(block, 0) != 0 || block_bytes < kDescriptorHeadBytes || block_bytes > block.size())
    return fault = "KTX2 file has no basic data format descriptor", false;
  const std::uint32_t model = block[8], transfer = block[10], flags = block[11];
  if (model != kModelEtc1s && model != kModelUastc)
    return fault = fmt::format("KTX2 file has the colour model {}, neither ETC1S nor UASTC", model), false;
  container.header.etc1s = model == kModelEtc1s;
  if (transfer != kTransferLinear && transfer != kTransferSrgb)
    return fault = fmt::format("KTX2 file has the transfer function {}, neither linear nor sRGB", transfer), false;
  container.header.srgb = transfer == kTransferSrgb;
  if ((flags & 1u) != 0) return fault = "KTX2 file has premultiplied alpha", false;
  if (!read_channels(container.header.etc1s, (block_bytes - kDescriptorHeadBytes) / kDescriptorSampleBytes, block,
                     container.header.alpha))
    return fault = "KTX2 file has channels other than RGB or RGBA", false;
  return true;
}

// Key/value data: the two keys that say how an image is to be seen must say that it is as it stands.
bool check_key_values(FileBytes bytes, std::string& fault) {
  FileBytes pairs;
  if (!part_of(bytes, word32(bytes, kKeyValuesAt), word32(bytes, kKeyValuesAt + 4), pairs))
    return fault = "key/value data of a KTX2 file reach beyond its end", false;
  while (!pairs.empty()) {
    if (pairs.size() < 4 || word32(pairs, 0) > pairs.size() - 4)
      return fault = "key/value data of a KTX2 file end inside a pair", false;
    const std::size_t length = word32(pairs, 0);
    const std::string_view pair(reinterpret_cast<const char*>(pairs.data() + 4), length);
    const std::size_t zero = pair.find('\0');
    if (zero == std::string_view::npos) return fault = "a key of a KTX2 file has no end", false;
    const std::string_view key = pair.substr(0, zero), value = pair.substr(zero + 1);
    const std::string_view text = value.substr(0, value.find('\0'));
    if (key == "KTXorientation" && text != "rd") return fault = "KTX2 file has an orientation other than rd", false;
    if (key == "KTXswizzle" && text != "rgba") return fault = "KTX2 file has a swizzle other than rgba", false;
    pairs = pairs.subspan(std::min(4 + (length + 3) / 4 * 4, pairs.size()));
  }
  return true;
}

bool read_scheme(FileBytes bytes, Container& container, std::string& fault) {
  const std::uint32_t scheme = word32(bytes, kSchemeAt);
  const bool sound = container.header.etc1s ? scheme == 1 : scheme == 0 || scheme == 2;
  if (!sound)
    return fault = fmt::format("KTX2 file has the supercompression scheme {}, which does not go with {}", scheme,
                               container.header.etc1s ? "ETC1S" : "UASTC"),
           false;
  container.scheme = static_cast<Supercompression>(scheme);
  if (!part_of(bytes, word64(bytes, kGlobalDataAt), word64(bytes, kGlobalDataAt + 8), container.global_data))
    return fault = "global data of a KTX2 file reach beyond its end", false;
  return true;
}

// Takes bytes from the front of `rest`.
bool take(FileBytes& rest, std::uint32_t length, FileBytes& part) {
  if (length > rest.size()) return false;
  part = rest.first(length);
  rest = rest.subspan(length);
  return true;
}

}  // namespace

bool is_ktx2(FileBytes bytes) {
  return bytes.size() >= kIdentifier.size() && std::equal(kIdentifier.begin(), kIdentifier.end(), bytes.begin());
}

bool read_container(FileBytes bytes, const ImageLimits& limits, Container& container, std::string& fault) {
  container = Container{};
  if (!is_ktx2(bytes)) return fault = "is no KTX2 file", false;
  if (bytes.size() < kIndexAt) return fault = "KTX2 file ends in its header", false;
  return read_sizes(bytes, limits, container, fault) && read_index(bytes, container, fault) &&
         read_descriptor(bytes, container, fault) && check_key_values(bytes, fault) &&
         read_scheme(bytes, container, fault);
}

bool read_basis_lz(const Container& container, BasisLzData& data, std::string& fault) {
  // Counts, lengths of four sections, then for each level flags and offset and length of two slices in its data.
  constexpr std::size_t kHeadBytes = 20, kSliceBytes = 20;
  constexpr std::uint32_t kFrameOfVideo = 2;
  const FileBytes global = container.global_data;
  const std::size_t head = kHeadBytes + kSliceBytes * container.levels.size();
  if (global.size() < head) return fault = "BasisLZ data end in their head", false;
  data.endpoint_count = word16(global, 0);
  data.selector_count = word16(global, 2);
  if (data.endpoint_count == 0 || data.selector_count == 0) return fault = "BasisLZ data have an empty codebook", false;
  FileBytes rest = global.subspan(head);
  if (!take(rest, word32(global, 4), data.endpoints) || !take(rest, word32(global, 8), data.selectors) ||
      !take(rest, word32(global, 12), data.tables) || rest.size() != word32(global, 16))
    return fault = "sections of BasisLZ data do not add up", false;
  data.levels.clear();
  for (std::size_t i = 0; i < container.levels.size(); ++i) {
    const std::size_t entry = kHeadBytes + kSliceBytes * i;
    const FileBytes level = container.levels[i].data;
    BasisLzData::Slices slices;
    if ((word32(global, entry) & kFrameOfVideo) != 0)
      return fault = fmt::format("level {} is a frame of a video", i), false;
    if (!part_of(level, word32(global, entry + 4), word32(global, entry + 8), slices.color) || slices.color.empty())
      return fault = fmt::format("the colour slice of level {} is not inside of it", i), false;
    if (container.header.alpha &&
        (!part_of(level, word32(global, entry + 12), word32(global, entry + 16), slices.alpha) || slices.alpha.empty()))
      return fault = fmt::format("the alpha slice of level {} is not inside of it", i), false;
    data.levels.push_back(slices);
  }
  return true;
}

}  // namespace tessera::ktx2
