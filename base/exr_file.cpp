#include "base/exr_file.h"

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <half.h>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"

namespace tessera {
namespace {

Imf::PixelType pixel_type(ExrChannel::Type type) {
  switch (type) {
    case ExrChannel::Type::kHalf: return Imf::HALF;
    case ExrChannel::Type::kFloat: return Imf::FLOAT;
    case ExrChannel::Type::kUint: return Imf::UINT;
  }
  return Imf::HALF;
}

std::vector<half> to_half(const ExrChannel& channel, std::size_t pixels) {
  std::vector<half> values(pixels);
  const float* source = static_cast<const float*>(channel.values);
  for (std::size_t i = 0; i < pixels; ++i) values[i] = half(source[i * channel.stride]);
  return values;
}

}  // namespace

void write_exr(const std::filesystem::path& target, int width, int height, const std::vector<ExrChannel>& channels) {
  AtomicFile file(target);
  try {
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::FrameBuffer frame_buffer;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::vector<std::vector<half>> halves;  // alive until the pixels are written
    halves.reserve(channels.size());
    for (const ExrChannel& channel : channels) {
      header.channels().insert(channel.name, Imf::Channel(pixel_type(channel.type)));
      const char* base = static_cast<const char*>(channel.values);
      std::size_t x_stride = channel.stride * 4;
      if (channel.type == ExrChannel::Type::kHalf) {
        base = reinterpret_cast<const char*>(halves.emplace_back(to_half(channel, pixels)).data());
        x_stride = sizeof(half);
      }
      frame_buffer.insert(channel.name, Imf::Slice(pixel_type(channel.type), const_cast<char*>(base), x_stride,
                                                   x_stride * static_cast<std::size_t>(width)));
    }
    Imf::OutputFile output(file.temporary().c_str(), header);
    output.setFrameBuffer(frame_buffer);
    output.writePixels(height);
  } catch (const std::exception& error) {
    throw SystemError(fmt::format("cannot write {}: {}", target.string(), error.what()));
  }
  file.commit();
}

Image read_exr(const std::filesystem::path& source, const ImageLimits& limits) {
  try {
    Imf::InputFile input(source.c_str(), 1);
    const Imath::Box2i window = input.header().dataWindow();
    const long width = static_cast<long>(window.max.x) - window.min.x + 1;
    const long height = static_cast<long>(window.max.y) - window.min.y + 1;
    if (width < 1 || height < 1) throw InputError(source.string(), "dataWindow", "is empty");
    if (width > limits.max_side || height > limits.max_side || static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) > limits.max_pixels)
      throw LimitError(fmt::format("{}: {}x{} pixels exceed the limit of {} a side and {} in all", source.string(), width, height, limits.max_side, limits.max_pixels));
    const bool alpha = input.header().channels().findChannel("A") != nullptr;
    for (const char* name : {"R", "G", "B"})
      if (input.header().channels().findChannel(name) == nullptr)
        throw InputError(source.string(), "channels", fmt::format("has no channel {}", name));

    Image image(static_cast<int>(width), static_cast<int>(height), alpha ? 4 : 3);
    const std::size_t x_stride = sizeof(float) * static_cast<std::size_t>(image.channels);
    const std::size_t y_stride = x_stride * static_cast<std::size_t>(width);
    Imf::FrameBuffer frame_buffer;
    for (int c = 0; c < image.channels; ++c) {
      // OpenEXR addresses pixels from (0, 0), wherever the data window lies: as integers, because that address may be no pointer's.
      const std::uintptr_t origin = reinterpret_cast<std::uintptr_t>(image.values.data() + c) - x_stride * static_cast<std::size_t>(static_cast<std::ptrdiff_t>(window.min.x)) -
                                    y_stride * static_cast<std::size_t>(static_cast<std::ptrdiff_t>(window.min.y));
      frame_buffer.insert(std::string(1, "RGBA"[c]), Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(origin), x_stride, y_stride));
    }
    input.setFrameBuffer(frame_buffer);
    input.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const InputError&) {
    throw;
  } catch (const LimitError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(source.string(), "", error.what());
  }
}

}  // namespace tessera
