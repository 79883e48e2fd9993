#include "scene/gltf/meshopt_codec.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "base/parallel.h"

namespace tessera::scene::gltf {
namespace {

using Encoded = std::span<const std::uint8_t>;

constexpr std::uint8_t kAttributes0 = 0xA0, kAttributes1 = 0xA1, kTriangles1 = 0xE1, kIndices1 = 0xD1;
constexpr std::uint64_t kGroup = 16;  // elements whose deltas are packed alike
constexpr std::uint64_t kMaxBlock = 256;
constexpr std::uint64_t kCodeTable = 16, kIndexPadding = 4;

// Bytes up to the tail; past the end every read fails and `ok` stays false.
struct CodedBytes {
  Encoded bytes;
  std::size_t at = 0;
  bool ok = true;

  // `count` bytes, or none.
  Encoded take(std::size_t count) {
    if (!ok || count > bytes.size() - at) {
      ok = false;
      return {};
    }
    at += count;
    return bytes.subspan(at - count, count);
  }
  std::uint8_t byte() {
    const Encoded one = take(1);
    return one.empty() ? std::uint8_t{0} : one[0];
  }
};

// 0, 1, 2, 3, 4 stand for 0, -1, 1, -2, 2; arithmetic wraps.
template <class T>
constexpr T unzigzag(T v) {
  return static_cast<T>((v & 1) != 0 ? ~(v >> 1) : (v >> 1));
}

// ---- Attributes -------------------------------------------------------------------------------------------------

std::uint64_t block_elements(std::uint64_t stride) { return std::min((8192 / stride) & ~(kGroup - 1), kMaxBlock); }

// The tail: the first element's predecessor and, in version 1, a mode for every 4 bytes; padded in front.
std::uint64_t tail_bytes(bool version1, std::uint64_t stride) {
  return version1 ? std::max<std::uint64_t>(stride + stride / 4, 24) : std::max<std::uint64_t>(stride, 32);
}

// 16 deltas of kBits bits each; all ones stand for a byte that follows the packed bits.
template <int kBits>
void read_packed(CodedBytes& in, std::uint8_t* out) {
  const Encoded packed = in.take(kGroup * kBits / 8);
  if (!in.ok) return;
  constexpr int kPerByte = 8 / kBits, kSentinel = (1 << kBits) - 1;
  const auto value = [&](int i) {
    // The first delta lies in the highest bits, of single bits in the lowest.
    const int slot = i % kPerByte, shift = kBits == 1 ? slot : 8 - kBits * (slot + 1);
    return (packed[static_cast<std::size_t>(i / kPerByte)] >> shift) & kSentinel;
  };
  constexpr int kCount = static_cast<int>(kGroup);
  if (in.bytes.size() - in.at < kGroup) {
    for (int i = 0; i < kCount; ++i) out[i] = value(i) == kSentinel ? in.byte() : static_cast<std::uint8_t>(value(i));
    return;
  }
  const std::uint8_t* next = in.bytes.data() + in.at;  // as many as can be asked for are there
  for (int i = 0; i < kCount; ++i) {
    const int v = value(i);
    const bool follows = v == kSentinel;
    out[i] = follows ? *next : static_cast<std::uint8_t>(v);
    next += follows ? 1 : 0;
  }
  in.at = static_cast<std::size_t>(next - in.bytes.data());
}

// 16 deltas of `bits` bits each (0: all are zero, 8: bytes).
void read_group(CodedBytes& in, int bits, std::uint8_t* out) {
  if (bits == 0) {
    std::fill_n(out, kGroup, std::uint8_t{0});
    return;
  }
  if (bits == 8) {
    const Encoded literal = in.take(kGroup);
    std::copy(literal.begin(), literal.end(), out);
    return;
  }
  if (bits == 1) read_packed<1>(in, out);
  if (bits == 2) read_packed<2>(in, out);
  if (bits == 4) read_packed<4>(in, out);
}

// Deltas of one byte position of a block: two bits of header for each group choose its number of bits.
void read_groups(CodedBytes& in, const std::array<int, 4>& bits, std::uint64_t elements, std::uint8_t* out) {
  const std::uint64_t groups = (elements + kGroup - 1) / kGroup;
  const Encoded header = in.take((groups + 3) / 4);
  for (std::uint64_t g = 0; g < groups && in.ok; ++g)
    read_group(in, bits[(header[g / 4] >> (2 * (g % 4))) & 3], out + g * kGroup);
}

using Deltas = std::array<std::array<std::uint8_t, kMaxBlock>, 4>;  // of the 4 bytes of a channel

// How version 1 stores the deltas of a byte position.
void read_controlled(CodedBytes& in, int control, std::uint64_t elements, std::uint8_t* out) {
  if (control == 0) {
    read_groups(in, {0, 1, 2, 4}, elements, out);
  } else if (control == 1) {
    read_groups(in, {1, 2, 4, 8}, elements, out);
  } else if (control == 2) {
    std::fill_n(out, elements, std::uint8_t{0});
  } else {
    const Encoded literal = in.take(elements);
    std::copy(literal.begin(), literal.end(), out);
  }
}

// Adds the deltas of one channel to `last`, element after element. Mode: 0 bytes, 1 pairs of bytes, 2 exclusive or of
// all four, turned left by the mode's high bits when it was written.
void apply_channel(const Deltas& deltas, std::uint8_t mode, std::uint64_t elements, std::uint64_t stride,
                   std::uint8_t* last, std::uint8_t* out) {
  std::array<std::uint8_t, 4> now;
  std::copy_n(last, 4, now.begin());
  const auto apply = [&](const auto& next) {
    for (std::uint64_t e = 0; e < elements; ++e, out += stride) {
      next(e);
      std::memcpy(out, now.data(), 4);
    }
  };
  if (mode == 0) {
    apply([&](std::uint64_t e) {
      for (std::size_t k = 0; k < 4; ++k) now[k] = static_cast<std::uint8_t>(now[k] + unzigzag(deltas[k][e]));
    });
  } else if (mode == 1) {
    apply([&](std::uint64_t e) {
      for (std::size_t k = 0; k < 4; k += 2) {
        const auto delta = static_cast<std::uint16_t>(deltas[k][e] | (deltas[k + 1][e] << 8));
        const auto value = static_cast<std::uint16_t>((now[k] | (now[k + 1] << 8)) + unzigzag(delta));
        now[k] = static_cast<std::uint8_t>(value);
        now[k + 1] = static_cast<std::uint8_t>(value >> 8);
      }
    });
  } else {
    apply([&](std::uint64_t e) {
      std::uint32_t delta = 0;
      for (std::size_t k = 0; k < 4; ++k) delta |= std::uint32_t{deltas[k][e]} << (8 * k);
      delta = std::rotr(delta, mode >> 4);
      for (std::size_t k = 0; k < 4; ++k) now[k] = static_cast<std::uint8_t>(now[k] ^ (delta >> (8 * k)));
    });
  }
  std::copy(now.begin(), now.end(), last);
}

bool decode_attributes(Encoded stream, std::uint64_t count, std::uint64_t stride, std::uint8_t* out,
                       std::string& fault) {
  if (stream[0] != kAttributes0 && stream[0] != kAttributes1)
    return fault = fmt::format("begins with 0x{:02x}, attributes with 0xa0 or 0xa1", stream[0]), false;
  const bool version1 = stream[0] == kAttributes1;
  const std::uint64_t tail = tail_bytes(version1, stride), channels = stride / 4;
  if (stream.size() < 1 + tail) return fault = "is shorter than its tail", false;
  const Encoded modes = stream.last(version1 ? channels : 0);
  const Encoded first = stream.first(stream.size() - modes.size()).last(stride);
  for (const std::uint8_t mode : modes)
    if ((mode & 15) > 2 || ((mode & 15) != 2 && mode >> 4 != 0))
      return fault = fmt::format("has the channel mode 0x{:02x}, which does not exist", mode), false;

  std::array<std::uint8_t, 256> last{};
  std::copy(first.begin(), first.end(), last.begin());
  CodedBytes in{stream.subspan(1, stream.size() - 1 - tail)};
  Deltas deltas;
  for (std::uint64_t begin = 0; begin < count && in.ok;) {
    const std::uint64_t elements = std::min(count - begin, block_elements(stride));
    const Encoded controls = in.take(version1 ? channels : 0);
    for (std::uint64_t c = 0; c < channels && in.ok; ++c) {
      for (std::size_t k = 0; k < 4 && in.ok; ++k) {
        if (version1)
          read_controlled(in, (controls[c] >> (2 * k)) & 3, elements, deltas[k].data());
        else
          read_groups(in, {0, 2, 4, 8}, elements, deltas[k].data());
      }
      if (in.ok)
        apply_channel(deltas, version1 ? modes[c] : std::uint8_t{0}, elements, stride, &last[4 * c],
                      out + begin * stride + 4 * c);
    }
    begin += elements;
  }
  if (!in.ok) return fault = fmt::format("ends before its {} elements", count), false;
  if (in.at != in.bytes.size())
    return fault = fmt::format("has {} bytes more than its {} elements need", in.bytes.size() - in.at, count), false;
  return true;
}

// ---- Indices ----------------------------------------------------------------------------------------------------

// meshoptimizer checks every length and wraps its tables of recent vertices, so any bytes are safe.
bool decode_indices(Encoded stream, const MeshoptLayout& layout, std::uint8_t* out, std::string& fault) {
  const bool triangles = layout.mode == MeshoptMode::kTriangles;
  if (const std::uint8_t head = triangles ? kTriangles1 : kIndices1; stream[0] != head)
    return fault = fmt::format("begins with 0x{:02x}, not with 0x{:02x}", stream[0], head), false;
  const int result = triangles
                         ? meshopt_decodeIndexBuffer(out, layout.count, layout.stride, stream.data(), stream.size())
                         : meshopt_decodeIndexSequence(out, layout.count, layout.stride, stream.data(), stream.size());
  if (result != 0) return fault = fmt::format("is shorter or longer than its {} indices need", layout.count), false;
  return true;
}

// ---- Filters ----------------------------------------------------------------------------------------------------

template <class T>
T rounded(float value) {
  const float max = static_cast<float>(std::numeric_limits<T>::max()), min = std::is_signed_v<T> ? -max : 0.0f;
  return static_cast<T>(std::round(std::clamp(value, min, max)));
}

// 1 as a signed normalised integer of K bits, `min_bits` <= K: a row of ones.
bool is_one(int value, int min_bits) { return value >= (1 << (min_bits - 1)) - 1 && ((value + 1) & value) == 0; }

// Elements that one thread filters at a time.
constexpr std::uint64_t kFilterChunk = 1 << 14;

// Calls filter(components) for every element of four components, on all threads; false with the first element where one
// is not valid.
template <class T, class Filter>
bool for_each_element(std::span<std::uint8_t> bytes, const Filter& filter, std::uint64_t& element) {
  const std::uint64_t count = bytes.size() / (4 * sizeof(T));
  std::atomic<std::uint64_t> fault = count;
  parallel_for((count + kFilterChunk - 1) / kFilterChunk, [&](std::size_t chunk) {
    const std::uint64_t end = std::min(count, (chunk + 1) * kFilterChunk);
    for (std::uint64_t e = chunk * kFilterChunk; e < end; ++e) {
      std::array<T, 4> v;
      std::uint8_t* const at = bytes.data() + e * sizeof v;
      std::memcpy(v.data(), at, sizeof v);
      if (!filter(v)) {
        std::uint64_t first = fault;
        while (e < first && !fault.compare_exchange_weak(first, e)) {
        }
        return;
      }
      std::memcpy(at, v.data(), sizeof v);
    }
  });
  element = fault;
  return element == count;
}

template <class T>
bool filter_octahedral(std::array<T, 4>& v) {
  if (!is_one(v[2], 2)) return false;
  constexpr auto kMax = static_cast<float>(std::numeric_limits<T>::max());
  const auto one = static_cast<float>(v[2]);
  float x = static_cast<float>(v[0]) / one, y = static_cast<float>(v[1]) / one;
  const float z = 1.0f - std::abs(x) - std::abs(y);
  // The lower half is folded over the corners of the upper one.
  const float fold = std::min(z, 0.0f);
  x -= std::copysign(fold, x);
  y -= std::copysign(fold, y);
  const float length = std::sqrt(x * x + y * y + z * z);
  v = {rounded<T>(x / length * kMax), rounded<T>(y / length * kMax), rounded<T>(z / length * kMax), v[3]};
  return true;
}

bool filter_quaternion(std::array<std::int16_t, 4>& v) {
  const int one = v[3] | 3;
  if (!is_one(one, 4)) return false;
  const float scale = 1.0f / std::sqrt(2.0f) / static_cast<float>(one);
  const float x = static_cast<float>(v[0]) * scale, y = static_cast<float>(v[1]) * scale,
              z = static_cast<float>(v[2]) * scale;
  const float w = std::sqrt(std::max(0.0f, 1.0f - x * x - y * y - z * z));
  const auto largest = static_cast<std::size_t>(v[3] & 3);
  v[(largest + 1) % 4] = rounded<std::int16_t>(x * 32767.0f);
  v[(largest + 2) % 4] = rounded<std::int16_t>(y * 32767.0f);
  v[(largest + 3) % 4] = rounded<std::int16_t>(z * 32767.0f);
  v[largest] = rounded<std::int16_t>(w * 32767.0f);
  return true;
}

// T unsigned. Luma and alpha are unsigned, the two chrominances signed.
template <class T>
bool filter_color(std::array<T, 4>& v) {
  if (v[3] < 2) return false;
  const int ones = (1 << std::bit_width(v[3])) - 1;
  const auto signed_number = [](T value) { return static_cast<int>(static_cast<std::make_signed_t<T>>(value)); };
  const int y = v[0], co = signed_number(v[1]), cg = signed_number(v[2]);
  const int alpha = v[3] & (ones >> 1);
  const float scale = static_cast<float>(std::numeric_limits<T>::max()) / static_cast<float>(ones);
  const auto scaled = [&](int value) { return rounded<T>(static_cast<float>(value) * scale); };
  v = {scaled(y + co - cg), scaled(y + cg), scaled(y - co - cg), scaled((alpha << 1) | (alpha & 1))};
  return true;
}

// mantissa * 2^exponent, exactly; a result beyond float becomes infinite, which readers of accessors refuse.
void filter_exponential(std::span<std::uint8_t> bytes) {
  const std::uint64_t count = bytes.size() / 4;
  parallel_for((count + kFilterChunk - 1) / kFilterChunk, [&](std::size_t chunk) {
    const std::uint64_t end = std::min(count, (chunk + 1) * kFilterChunk);
    for (std::uint64_t i = chunk * kFilterChunk; i < end; ++i) {
      std::int32_t packed;
      std::memcpy(&packed, bytes.data() + 4 * i, 4);
      const auto mantissa = static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(packed) << 8) >> 8);
      const int exponent = packed >> 24;
      // A product with a normal power of two is rounded once, as ldexp is.
      const float value = exponent < -126
                              ? std::ldexp(mantissa, exponent)
                              : mantissa * std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23);
      std::memcpy(bytes.data() + 4 * i, &value, 4);
    }
  });
}

bool apply_filter(const MeshoptLayout& layout, std::span<std::uint8_t> out, std::string& fault) {
  std::uint64_t element = 0;
  bool sound = true;
  switch (layout.filter) {
    case MeshoptFilter::kNone:
      return true;
    case MeshoptFilter::kExponential:
      filter_exponential(out);
      return true;
    case MeshoptFilter::kOctahedral:
      sound = layout.stride == 4 ? for_each_element<std::int8_t>(out, filter_octahedral<std::int8_t>, element)
                                 : for_each_element<std::int16_t>(out, filter_octahedral<std::int16_t>, element);
      break;
    case MeshoptFilter::kQuaternion:
      sound = for_each_element<std::int16_t>(out, filter_quaternion, element);
      break;
    case MeshoptFilter::kColor:
      sound = layout.stride == 4 ? for_each_element<std::uint8_t>(out, filter_color<std::uint8_t>, element)
                                 : for_each_element<std::uint16_t>(out, filter_color<std::uint16_t>, element);
      break;
  }
  if (!sound) fault = fmt::format("element {} does not say the scale that its filter needs", element);
  return sound;
}

}  // namespace

std::uint64_t min_meshopt_bytes(const MeshoptLayout& layout) {
  if (layout.mode == MeshoptMode::kTriangles) return 1 + layout.count / 3 + kCodeTable;
  if (layout.mode == MeshoptMode::kIndices) return 1 + layout.count + kIndexPadding;
  // Version 1 with nothing but zeros: two bits for each byte position of a block.
  const std::uint64_t block = block_elements(layout.stride), blocks = (layout.count + block - 1) / block;
  return 1 + blocks * (layout.stride / 4) + tail_bytes(true, layout.stride);
}

bool decode_meshopt(Encoded stream, const MeshoptLayout& layout, std::span<std::uint8_t> out, std::string& fault) {
  if (stream.size() < min_meshopt_bytes(layout))
    return fault = fmt::format("has {} bytes, too few for its {} elements", stream.size(), layout.count), false;
  if (layout.mode != MeshoptMode::kAttributes) return decode_indices(stream, layout, out.data(), fault);
  return decode_attributes(stream, layout.count, layout.stride, out.data(), fault) && apply_filter(layout, out, fault);
}

}  // namespace tessera::scene::gltf
