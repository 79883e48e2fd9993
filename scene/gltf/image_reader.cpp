#include "scene/gltf/image_reader.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

namespace tessera::scene::gltf {
namespace {

// Calls read(); limits that it meets get the place of the image.
template <class Read>
void of_image(const Place& place, const Read& read) {
  try {
    read();
  } catch (const BudgetError&) {
    throw;
  } catch (const LimitError& error) {
    throw LimitError(fmt::format("{}: {}: {}", place.file(), place.pointer(), error.what()));
  }
}

// Levels that are made: a third more, and sums on the way.
void charge_levels(const ImageAccount& account, int width, int height, std::uint64_t copies) {
  account.budget.charge(static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height), 6 * copies,
                        account.place);
}

// Decodes, and charges the 8-bit texture with its mip levels, or the 16-bit heights with theirs.
DecodedImage decode_plain_image(Bytes bytes, const ImageAccount& account, TextureSource& source) {
  DecodedImage decoded;
  of_image(account.place, [&] {
    std::string fault;
    const auto charge = [&](std::uint64_t count) { account.budget.charge(count, 1, account.place); };
    if (ktx2::is_ktx2(bytes)) account.place.refuse("is KTX2, which only KHR_texture_basisu may name");
    if (!decode_image(bytes, account.limits, decoded, fault, charge)) account.place.refuse("{}", fault);
  });
  const ImageFormat format = image_format(bytes);
  source.format = format == ImageFormat::kJpeg   ? TextureFormat::kJpeg
                  : format == ImageFormat::kWebp ? TextureFormat::kWebp
                                                 : TextureFormat::kPng;
  charge_levels(account, decoded.width(), decoded.height(), 1);
  return decoded;
}

}  // namespace

ColorImage read_color_image(Bytes bytes, shaders::ColorSpace space, const ImageAccount& account) {
  ColorImage out;
  out.texture = std::make_shared<const shaders::Texture>(decode_plain_image(bytes, account, out.source), space);
  return out;
}

HeightImage read_height_image(Bytes bytes, const ImageAccount& account) {
  HeightImage out;
  out.texture = std::make_shared<const shaders::ScalarTexture>(decode_plain_image(bytes, account, out.source));
  return out;
}

UnpackedBasis unpack_basis_image(Bytes bytes, const ImageAccount& account) {
  UnpackedBasis out;
  std::string fault;
  of_image(account.place, [&] {
    ktx2::Ktx2Header header;
    if (!ktx2::is_ktx2(bytes)) account.place.refuse("is no KTX2 image, which KHR_texture_basisu names");
    if (!ktx2::read_ktx2_header(bytes, account.limits, header, fault)) account.place.refuse("{}", fault);
    account.budget.charge(*std::max_element(header.unpacking_bytes.begin(), header.unpacking_bytes.end()), 1,
                          account.place);
    charge_levels(account, header.width, header.height, header.unpacking_bytes.size());
    out.source = {header.etc1s ? TextureFormat::kKtx2Etc1s : TextureFormat::kKtx2Uastc, header.levels};
    if (!ktx2::decode_ktx2(bytes, ktx2::BasisTarget::kRgba32, account.limits, out.texture, fault))
      account.place.refuse("{}", fault);
  });
  return out;
}

}  // namespace tessera::scene::gltf
