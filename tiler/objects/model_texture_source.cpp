#include <gdal_priv.h>

#include <algorithm>
#include <memory>

#include "core/error.h"
#include "core/image_io.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"
#include "tiler/objects/model_texture.h"
#include "world/texture.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using core::Image8;

std::uint8_t eight_bits(std::uint8_t value) { return value; }
std::uint8_t eight_bits(std::uint16_t value) {
  return static_cast<std::uint8_t>((value * 255U + 32895U) >> 16U);
}

template <class T>
Image8 with_colors(const core::Image<T>& image) {
  const bool has_alpha = image.channels() == 2 || image.channels() == 4;
  const int num_colors = image.channels() >= 3 ? 3 : 1;
  Image8 out(image.width(), image.height(), has_alpha ? 4 : 3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      for (int k = 0; k < 3; ++k)
        out(x, y, k) = eight_bits(image(x, y, std::min(k, num_colors - 1)));
      if (has_alpha) out(x, y, 3) = eight_bits(image(x, y, num_colors));
    }
  return out;
}

void check_size(int width, int height, int most_channels, const std::string& name,
                std::uint64_t bytes_left) {
  world::check_texture(name, width, height, 3);
  if (const std::uint64_t bytes = world::mip_bytes(width, height, most_channels);
      bytes > bytes_left)
    fail(ErrorKind::Input,
         "{}: its {} x {} pixels take up to {} bytes of memory, and {} are left of the {} that all "
         "textures may take; make them smaller",
         name, width, height, bytes, bytes_left, world::kMaxTexturesBytes);
}

Image8 decode_jpeg(std::span<const std::byte> bytes, const std::string& name,
                   std::uint64_t bytes_left) {
  register_gdal();
  // GDAL reads memory as a file of a name; the name is this call's own.
  const std::string file =
      fmt::format("/vsimem/terracast-texture-{}.jpg", static_cast<const void*>(bytes.data()));
  // It takes the bytes as they are, and does not write.
  auto* data = const_cast<GByte*>(reinterpret_cast<const GByte*>(bytes.data()));
  VSIFCloseL(VSIFileFromMemBuffer(file.c_str(), data, bytes.size(), FALSE));
  struct Unlink {
    const std::string& name;
    ~Unlink() { VSIUnlink(name.c_str()); }
  } unlink{file};
  const char* const drivers[] = {"JPEG", nullptr};
  const std::unique_ptr<GDALDataset> dataset(
      GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers));
  if (!dataset) fail(ErrorKind::Input, "{}: neither a PNG nor a JPEG that can be read", name);
  const int width = dataset->GetRasterXSize();
  const int height = dataset->GetRasterYSize();
  const int num_bands = dataset->GetRasterCount();
  check_size(width, height, 3, name, bytes_left);
  if (num_bands != 1 && num_bands != 3)
    fail(ErrorKind::Input, "{}: a JPEG of {} bands; 1 and 3 are read", name, num_bands);
  Image8 image(width, height, 3);
  for (int k = 0; k < 3; ++k)
    if (dataset->GetRasterBand(std::min(k + 1, num_bands))
            ->RasterIO(GF_Read, 0, 0, width, height, image.data().data() + k, width, height,
                       GDT_Byte, 3, static_cast<GSpacing>(3) * width, nullptr) != CE_None)
      fail(ErrorKind::Input, "{}: damaged", name);
  return image;
}

bool is_png(std::span<const std::byte> bytes) {
  const auto byte = [&](std::size_t at) { return static_cast<std::uint32_t>(bytes[at]); };
  return bytes.size() > 24 && byte(0) == 0x89 && byte(1) == 'P' && byte(2) == 'N' && byte(3) == 'G';
}

Image8 decode_png(std::span<const std::byte> bytes, const std::string& name,
                  std::uint64_t bytes_left) {
  const auto byte = [&](std::size_t at) { return static_cast<std::uint32_t>(bytes[at]); };
  const auto side = [&](std::size_t at) {
    return static_cast<int>(std::min<std::uint32_t>(
        byte(at) << 24U | byte(at + 1) << 16U | byte(at + 2) << 8U | byte(at + 3), 0x7fffffffU));
  };
  check_size(side(16), side(20), 4, name, bytes_left);
  const auto image = core::decode_png(bytes, name, world::kMaxTexturePixels);
  return std::visit([](const auto& own) { return with_colors(own); }, image);
}

}  // namespace

core::Image8 decode_texture(std::span<const std::byte> bytes, const std::string& name,
                            std::uint64_t& bytes_left) {
  Image8 image =
      is_png(bytes) ? decode_png(bytes, name, bytes_left) : decode_jpeg(bytes, name, bytes_left);
  bytes_left -= world::mip_bytes(image.width(), image.height(), image.channels());
  return image;
}

}  // namespace terracast::tiler
