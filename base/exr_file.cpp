#include "base/exr_file.h"

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"

namespace tessera {
namespace {

Imf::PixelType pixel_type(ExrChannel::Type type) {
  switch (type) {
    case ExrChannel::Type::kHalf:
      return Imf::HALF;
    case ExrChannel::Type::kFloat:
      return Imf::FLOAT;
    case ExrChannel::Type::kUint:
      return Imf::UINT;
  }
  return Imf::HALF;
}

constexpr float kLargestHalf = 65504.0f;

// Converts pixels from `first` on to halves. Values beyond the largest half are clamped to it, so a bright light stays
// finite.
void to_half(const ExrChannel& channel, std::size_t first, std::vector<half>& values) {
  const float* source = static_cast<const float*>(channel.values) + first * channel.stride;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = source[i * channel.stride];
    values[i] = half(std::isnan(value) ? value : std::clamp(value, -kLargestHalf, kLargestHalf));
  }
}

// Rows that are compressed together, at most; so many are made halves at a time.
constexpr int kRowsAtOnce = 32;

// A file in memory.
class MemoryStream : public Imf::IStream {
 public:
  explicit MemoryStream(std::span<const std::uint8_t> bytes) : Imf::IStream("EXR"), bytes_(bytes) {}
  bool read(char to[], int count) override {
    const auto size = static_cast<std::uint64_t>(std::max(count, 0));
    if (at_ > bytes_.size() || size > bytes_.size() - at_) throw std::runtime_error("ends early");
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t at) override { at_ = at; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::uint64_t at_ = 0;
};

// OpenEXR 3.1 allocates memory for the header's attributes before it looks at the rest of the file. So the header is
// walked first: every attribute must lie inside the file, the image within the limits, and the channels may not
// outnumber the file's bytes.
class HeaderWalk {
 public:
  HeaderWalk(Imf::IStream& in, std::uint64_t size, std::string name)
      : name_(std::move(name)), before_(name_.empty() ? "" : name_ + ": "), in_(in), left_(size) {}

  void check(const ImageLimits& limits) {
    constexpr std::uint32_t kMagic = 20000630, kParts = 0x1000;
    if (word() != kMagic) throw InputError(name_, "byte 0", "is not an EXR file");
    const bool parts = (word() & kParts) != 0;
    while (check_part(limits) && parts) continue;  // parts end with one without attributes
  }

 private:
  // False: no attributes.
  bool check_part(const ImageLimits& limits) {
    std::string attribute = text();
    if (attribute.empty()) return false;
    for (; !attribute.empty(); attribute = text()) {
      const std::string type = text();
      const std::uint32_t size = word();
      if (size > left_) throw InputError(name_, attribute, "is longer than the file");
      const std::uint64_t end = left_ - size;
      check_value(attribute, type, size, limits);
      if (left_ < end || (type == "chlist" && left_ != end))
        throw InputError(name_, attribute, "has another length than it says");
      skip(left_ - end);
    }
    return true;
  }

  // OpenEXR reads values of the types that it knows as long as the type says, not as long as the attribute does.
  void check_value(const std::string& attribute, const std::string& type, std::uint32_t size,
                   const ImageLimits& limits) {
    static const std::map<std::string_view, std::uint32_t> kSizes = {{"box2f", 16},
                                                                     {"box2i", 16},
                                                                     {"chromaticities", 32},
                                                                     {"compression", 1},
                                                                     {"deepImageState", 1},
                                                                     {"double", 8},
                                                                     {"envmap", 1},
                                                                     {"float", 4},
                                                                     {"int", 4},
                                                                     {"keycode", 28},
                                                                     {"lineOrder", 1},
                                                                     {"m33d", 72},
                                                                     {"m33f", 36},
                                                                     {"m44d", 128},
                                                                     {"m44f", 64},
                                                                     {"rational", 8},
                                                                     {"tiledesc", 9},
                                                                     {"timecode", 8},
                                                                     {"v2d", 16},
                                                                     {"v2f", 8},
                                                                     {"v2i", 8},
                                                                     {"v3d", 24},
                                                                     {"v3f", 12},
                                                                     {"v3i", 12}};
    if (const auto known = kSizes.find(type); known != kSizes.end() && known->second != size)
      throw InputError(name_, attribute, fmt::format("has {} bytes, a {} has {}", size, type, known->second));
    if (type == "chlist") {
      if (size > kMaxChannelBytes)
        throw LimitError(fmt::format("{}channels of {} bytes, the limit is {}", before_, size, kMaxChannelBytes));
      while (!text().empty()) skip(16);
    } else if (type == "preview") {
      const std::uint64_t width = word(), height = word();
      if (size < 8 || width > size || height > size || 4 * width * height != size - 8)
        throw InputError(name_, attribute, "has another size than its pixels");
    } else if (type == "stringvector" || type == "idmanifest" || (type == "floatvector" && size % 4 != 0)) {
      throw InputError(name_, attribute, fmt::format("is a {}, whose parts have lengths of their own", type));
    }
    if (attribute == "dataWindow" && type == "box2i") check_window(limits);
    if (attribute == "tiles" && type == "tiledesc") check_tile(limits);
  }
  static constexpr std::uint32_t kMaxChannelBytes = 4096;  // some two hundred channels

  void read(char* bytes, std::size_t count) {
    if (count > left_) throw InputError(name_, "", "ends inside its header");
    in_.read(bytes, static_cast<int>(count));
    left_ -= count;
  }
  void skip(std::uint64_t count) {
    if (count > left_) throw InputError(name_, "", "ends inside its header");
    in_.seekg(in_.tellg() + count);
    left_ -= count;
  }
  std::uint32_t word() {
    unsigned char b[4];
    read(reinterpret_cast<char*>(b), 4);
    return b[0] | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 | std::uint32_t{b[3]} << 24;
  }
  std::string text() {
    constexpr std::size_t kLongest = 255;
    std::string out;
    for (char c = 0; read(&c, 1), c != 0;) {
      if (out.size() == kLongest) throw InputError(name_, "", "has a name of more than 255 characters in its header");
      out += c;
    }
    return out;
  }
  void check_window(const ImageLimits& limits) {
    std::int64_t edge[4];
    for (std::int64_t& e : edge) e = static_cast<std::int32_t>(word());
    const std::int64_t width = edge[2] - edge[0] + 1, height = edge[3] - edge[1] + 1;
    if (width < 1 || height < 1) throw InputError(name_, "dataWindow", "is empty");
    if (width > limits.max_side || height > limits.max_side ||
        static_cast<std::uint64_t>(width * height) > limits.max_pixels)
      throw LimitError(fmt::format("{}{}x{} pixels exceed the limit of {} a side and {} in all", before_, width, height,
                                   limits.max_side, limits.max_pixels));
  }

  void check_tile(const ImageLimits& limits) {
    const std::uint64_t width = word(), height = word();
    const auto side = static_cast<std::uint64_t>(limits.max_side);
    if (width > side || height > side || width * height > limits.max_pixels)
      throw LimitError(fmt::format("{}tiles of {}x{} pixels exceed the limits of an image", before_, width, height));
  }

  std::string name_, before_;  // messages begin with
  Imf::IStream& in_;
  std::uint64_t left_;
};

// Reads as read_exr() does, from a stream of `size` bytes that messages call `name`.
Image read_stream(Imf::IStream& stream, std::uint64_t size, const std::string& name, const ImageLimits& limits,
                  const ChargeBytes& charge) {
  HeaderWalk(stream, size, name).check(limits);
  stream.seekg(0);
  Imf::InputFile input(stream, 1);
  const Imath::Box2i window = input.header().dataWindow();
  const long width = static_cast<long>(window.max.x) - window.min.x + 1;
  const long height = static_cast<long>(window.max.y) - window.min.y + 1;
  const bool alpha = input.header().channels().findChannel("A") != nullptr;
  for (const char* channel : {"R", "G", "B"})
    if (input.header().channels().findChannel(channel) == nullptr)
      throw InputError(name, "channels", fmt::format("has no channel {}", channel));
  // The image, and rows or tiles of it on the way.
  if (charge) charge(static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * (alpha ? 32 : 24));

  Image image(static_cast<int>(width), static_cast<int>(height), alpha ? 4 : 3);
  const std::size_t x_stride = sizeof(float) * static_cast<std::size_t>(image.channels);
  const std::size_t y_stride = x_stride * static_cast<std::size_t>(width);
  Imf::FrameBuffer frame_buffer;
  for (int c = 0; c < image.channels; ++c) {
    // OpenEXR addresses pixels from (0, 0), wherever the data window lies: as integers, because that address may be
    // no pointer's.
    const std::uintptr_t origin = reinterpret_cast<std::uintptr_t>(image.values.data() + c) -
                                  x_stride * static_cast<std::size_t>(static_cast<std::ptrdiff_t>(window.min.x)) -
                                  y_stride * static_cast<std::size_t>(static_cast<std::ptrdiff_t>(window.min.y));
    frame_buffer.insert(std::string(1, "RGBA"[c]),
                        Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(origin), x_stride, y_stride));
  }
  input.setFrameBuffer(frame_buffer);
  input.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

void write_exr(const std::filesystem::path& target, int width, int height, const std::vector<ExrChannel>& channels,
               ExrCompression compression) {
  AtomicFile file(target);
  try {
    Imf::Header header(width, height);
    static constexpr Imf::Compression kCompressions[] = {
        Imf::PIZ_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::RLE_COMPRESSION, Imf::NO_COMPRESSION};
    header.compression() = kCompressions[static_cast<std::size_t>(compression)];
    for (const ExrChannel& channel : channels)
      header.channels().insert(channel.name, Imf::Channel(pixel_type(channel.type)));
    Imf::OutputFile output(file.temporary().c_str(), header);
    std::vector<std::vector<half>> halves(channels.size());
    for (int y = 0; y < height; y += kRowsAtOnce) {
      const int rows = std::min(kRowsAtOnce, height - y);
      const std::size_t row_pixels = static_cast<std::size_t>(width), first = static_cast<std::size_t>(y) * row_pixels;
      Imf::FrameBuffer frame_buffer;
      for (std::size_t c = 0; c < channels.size(); ++c) {
        const ExrChannel& channel = channels[c];
        const Imath::Box2i window(Imath::V2i(0, y), Imath::V2i(width - 1, y + rows - 1));
        std::size_t x_stride = channel.stride * 4;
        const char* base = static_cast<const char*>(channel.values) + first * x_stride;
        if (channel.type == ExrChannel::Type::kHalf) {
          halves[c].resize(static_cast<std::size_t>(rows) * row_pixels);
          to_half(channel, first, halves[c]);
          base = reinterpret_cast<const char*>(halves[c].data());
          x_stride = sizeof(half);
        }
        frame_buffer.insert(channel.name,
                            Imf::Slice::Make(pixel_type(channel.type), base, window, x_stride, x_stride * row_pixels));
      }
      output.setFrameBuffer(frame_buffer);
      output.writePixels(rows);
    }
  } catch (const std::exception& error) {
    // 'Failed to write pixel data to image file "NAME". No space left on device.', of a name that is not the user's.
    std::string reason = error.what();
    if (const std::size_t at = reason.rfind("\". "); at != std::string::npos) reason = reason.substr(at + 3);
    if (reason.ends_with('.')) reason.pop_back();
    throw WriteError(fmt::format("cannot write {}: {}", target.string(), reason));
  }
  file.commit();
}

Image read_exr(const std::filesystem::path& source, const ImageLimits& limits) {
  const std::string name = source.string();
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(source, ignored)) throw InputError(name, "", "cannot be read");
  try {
    Imf::StdIFStream stream(source.c_str());
    return read_stream(stream, std::filesystem::file_size(source), name, limits, {});
  } catch (const InputError&) {
    throw;
  } catch (const LimitError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(name, "", error.what());
  }
}

bool decode_exr(std::span<const std::uint8_t> bytes, const ImageLimits& limits, Image& image, std::string& fault,
                const ChargeBytes& charge) {
  try {
    MemoryStream stream(bytes);
    image = read_stream(stream, bytes.size(), "", limits, charge);
    return true;
  } catch (const InputError& error) {
    fault = error.place().empty() ? error.fault() : fmt::format("{} {}", error.place(), error.fault());
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    fault = error.what();
  }
  return false;
}

}  // namespace tessera
